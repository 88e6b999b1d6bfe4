// Triangles of the shapes: flat arrays { position, normal }, three vertices a triangle.

// Steps around a full turn: round to the eye at the size of a report.
var AROUND = 32;
// Faces that meet at a sharper angle than this have an edge between them; cosine of 40 degrees.
var CREASE = 0.77;

function solid() { return { position: [], normal: [] }; }

function triangle(out, points, normals) {
  for (var k = 0; k !== 3; k++) {
    Array.prototype.push.apply(out.position, points[k]);
    Array.prototype.push.apply(out.normal, normals[k]);
  }
}

function quad(out, p, n) {
  triangle(out, [p[0], p[1], p[2]], [n[0], n[1], n[2]]);
  triangle(out, [p[0], p[2], p[3]], [n[0], n[2], n[3]]);
}

// A cube from -1 to 1.
function cube() {
  var out = solid();
  for (var axis = 0; axis !== 3; axis++) {
    [-1, 1].forEach(function (side) {
      var n = [0, 0, 0];
      n[axis] = side;
      var u = [0, 0, 0], v;
      u[(axis + 1) % 3] = 1;
      v = cross(n, u);
      var corner = function (a, b) { return add(n, add(scaled(u, a), scaled(v, b))); };
      quad(out, [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)], [n, n, n, n]);
    });
  }
  return out;
}

// A surface of revolution about z; `profile` has rows [radius, height, normal's radius, normal's height], from below.
function lathe(profile) {
  var out = solid();
  var at = function (row, step) {
    var angle = 2 * Math.PI * step / AROUND, c = Math.cos(angle), s = Math.sin(angle);
    return { p: [row[0] * c, row[0] * s, row[1]], n: [row[2] * c, row[2] * s, row[3]] };
  };
  profile.slice(1).forEach(function (above, i) {
    var below = profile[i];
    for (var step = 0; step !== AROUND; step++) {
      var a = at(below, step), b = at(below, step + 1), c = at(above, step + 1), d = at(above, step);
      quad(out, [a.p, b.p, c.p, d.p], [a.n, b.n, c.n, d.n]);
    }
  });
  return out;
}

// Rows of half a circle from below to above, its upper half raised by `lift` and its lower half sunk by it.
function arc(radius, lift) {
  var rows = [], half = AROUND / 4;
  for (var k = -half; k !== half + 1; k++) {
    var angle = Math.PI / 2 * k / half, c = Math.cos(angle), s = Math.sin(angle);
    if (k === 0) { rows.push([radius, -lift, 1, 0]); }
    rows.push([radius * c, radius * s + (0 > k ? -lift : lift), c, s]);
  }
  return rows;
}

function ball() { return lathe(arc(1, 0)); }
function capsule(radius, half) { return lathe(arc(radius, half)); }
function cylinder() {
  return lathe([[0, -1, 0, -1], [1, -1, 0, -1], [1, -1, 1, 0], [1, 1, 1, 0], [1, 1, 0, 1], [0, 1, 0, 1]]);
}
function square() {
  var out = solid(), n = [0, 0, 1];
  quad(out, [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [n, n, n, n]);
  return out;
}

// Triangles by vertices and indices, with normals that are smooth but for edges.
function faceted(vertices, indices) {
  var out = solid(), faces = [], around = vertices.map(function () { return []; });
  for (var t = 0; t !== indices.length; t += 3) {
    var corners = [indices[t], indices[t + 1], indices[t + 2]];
    var p = corners.map(function (v) { return vertices[v]; });
    // Its length is twice the area: larger faces weigh more.
    var normal = cross(subtract(p[1], p[0]), subtract(p[2], p[0]));
    faces.push({ corners: corners, normal: normal, unit: unit(normal) });
    corners.forEach(function (v) { around[v].push(faces.length - 1); });
  }
  faces.forEach(function (face) {
    var normals = face.corners.map(function (v) {
      return unit(around[v].reduce(function (sum, i) {
        return dot(face.unit, faces[i].unit) > CREASE ? add(sum, faces[i].normal) : sum;
      }, [0, 0, 0]));
    });
    triangle(out, face.corners.map(function (v) { return vertices[v]; }), normals);
  });
  return out;
}

// An arrow along z of length 1 with a shaft of this radius.
function arrow(radius) {
  var neck = 0.72, head = 2.4 * radius;
  return lathe([[0, 0, 0, -1], [radius, 0, 0, -1], [radius, 0, 1, 0], [radius, neck, 1, 0], [radius, neck, 0, -1],
    [head, neck, 0, -1], [head, neck, 0.93, 0.36], [0, 1, 0.93, 0.36]]);
}

// A round arrow about z: part of a ring of radius 1 that sweeps `angle`, a head at its end.
function ringArrow(radius, angle) {
  // A small one is thin too, so that it still looks like an arrow.
  radius *= Math.min(1, Math.abs(angle) / 0.9);
  var out = solid(), sign = 0 > angle ? -1 : 1, head = Math.min(0.45, Math.abs(angle) / 2), steps = 36, sides = 10;
  var row = function (along, r) {
    var radial = [Math.cos(along), Math.sin(along), 0], ring = [];
    for (var k = 0; k !== sides + 1; k++) {
      var a = 2 * Math.PI * k / sides * sign, n = add(scaled(radial, Math.cos(a)), [0, 0, Math.sin(a)]);
      ring.push({ p: add(radial, scaled(n, r)), n: n });
    }
    return ring;
  };
  var join = function (a, b) {
    for (var k = 0; k !== sides; k++) {
      quad(out, [a[k].p, a[k + 1].p, b[k + 1].p, b[k].p].reverse(), [a[k].n, a[k + 1].n, b[k + 1].n, b[k].n].reverse());
    }
  };
  var neck = angle - sign * head, rows = [row(0, 0)];
  for (var s = 0; s !== steps + 1; s++) { rows.push(row(neck * s / steps, radius)); }
  rows.push(row(neck, 2.4 * radius), row(neck + sign * head / 2, 1.3 * radius), row(angle, 0));
  rows.slice(1).forEach(function (next, i) { join(rows[i], next); });
  return out;
}
