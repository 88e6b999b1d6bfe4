// Vectors, quaternions (w x y z) and 4 x 4 matrices, the latter as 16 numbers column by column.

function add(a, b) { return [a[0] + b[0], a[1] + b[1], a[2] + b[2]]; }
function subtract(a, b) { return [a[0] - b[0], a[1] - b[1], a[2] - b[2]]; }
function scaled(a, s) { return [a[0] * s, a[1] * s, a[2] * s]; }
function dot(a, b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
function length(a) { return Math.sqrt(dot(a, a)); }
function unit(a) { return scaled(a, 1 / (length(a) || 1)); }
function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

// A vector at right angles to another.
function across(a) {
  return unit(cross(a, Math.abs(a[2]) > 0.8 * length(a) ? [1, 0, 0] : [0, 0, 1]));
}

function turned(q, v) {
  var w = q[0], u = [q[1], q[2], q[3]];
  var t = scaled(cross(u, v), 2);
  return add(add(v, scaled(t, w)), cross(u, t));
}

function times(p, q) {
  return [
    p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
    p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
    p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
    p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0]
  ];
}

// A pose is { place, turn }: world_from_part.
function within(outer, inner) {
  return { place: add(outer.place, turned(outer.turn, inner.place)), turn: times(outer.turn, inner.turn) };
}

// Between two poses, the shorter way round.
function between(a, b, share) {
  var sign = a.turn[0] * b.turn[0] + a.turn[1] * b.turn[1] + a.turn[2] * b.turn[2] + a.turn[3] * b.turn[3] < 0 ? -1 : 1;
  var turn = a.turn.map(function (x, k) { return x + share * (sign * b.turn[k] - x); });
  var norm = Math.sqrt(turn.reduce(function (sum, x) { return sum + x * x; }, 0)) || 1;
  return {
    place: add(a.place, scaled(subtract(b.place, a.place), share)),
    turn: turn.map(function (x) { return x / norm; })
  };
}

function poseMatrix(pose, size) {
  var x = turned(pose.turn, [size[0], 0, 0]), y = turned(pose.turn, [0, size[1], 0]), z = turned(pose.turn, [0, 0, size[2]]);
  var p = pose.place;
  return [x[0], x[1], x[2], 0, y[0], y[1], y[2], 0, z[0], z[1], z[2], 0, p[0], p[1], p[2], 1];
}

function product(a, b) {
  var out = new Array(16);
  for (var c = 0; c !== 4; c++) {
    for (var r = 0; r !== 4; r++) {
      out[4 * c + r] = a[r] * b[4 * c] + a[4 + r] * b[4 * c + 1] + a[8 + r] * b[4 * c + 2] + a[12 + r] * b[4 * c + 3];
    }
  }
  return out;
}

// Perspective with a vertical angle of view, rad.
function perspective(angle, aspect, near, far) {
  var f = 1 / Math.tan(angle / 2), d = 1 / (near - far);
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) * d, -1, 0, 0, 2 * far * near * d, 0];
}

// Camera at `eye` that looks at `target`, with z up.
function lookAt(eye, target) {
  var back = unit(subtract(eye, target));
  var right = unit(cross([0, 0, 1], back)), up = cross(back, right);
  return [
    right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
    -dot(right, eye), -dot(up, eye), -dot(back, eye), 1
  ];
}

// Onto the plane z = `height` along `light`, which points towards the light.
function shadowMatrix(light, height) {
  var x = -light[0] / light[2], y = -light[1] / light[2];
  return [1, 0, 0, 0, 0, 1, 0, 0, x, y, 0, 0, -x * height, -y * height, height, 1];
}
