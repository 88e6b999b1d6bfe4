// The data of a view, read: shapes, meshes, and where every part is at a time.

// Steps across the box that positions are counted in, and what a missing pose begins with.
var STEPS = 65534, MISSING = 65535;

function numbers(text) {
  var bytes = atob(text), out = new Uint16Array(bytes.length / 2);
  for (var i = 0; i !== out.length; i++) { out[i] = bytes.charCodeAt(2 * i) + 256 * bytes.charCodeAt(2 * i + 1); }
  return out;
}

function point(data, at, box) {
  return [0, 1, 2].map(function (k) { return box.low[k] + data[at + k] / STEPS * box.size; });
}

function points(text, box) {
  var data = numbers(text), out = [];
  for (var i = 0; i !== data.length; i += 3) { out.push(point(data, i, box)); }
  return out;
}

// Vertices and indices of a mesh as a solid.
function meshSolid(mesh) {
  return faceted(points(mesh.vertices, mesh), numbers(mesh.triangles));
}

// An episode. `parts` counts the parts with the world.
function readTake(take, parts) {
  var moving = parts - 1, frames = take.time.length;
  var machines = take.machines.map(function (machine) {
    var data = numbers(machine.poses), contacts = points(machine.contacts, take), from = 0;
    var poses = [], touching = [];
    for (var f = 0; f !== frames; f++) {
      var row = [{ place: [0, 0, 0], turn: [1, 0, 0, 0] }];
      for (var p = 0; p !== moving; p++) {
        var at = 7 * (f * moving + p);
        row.push(data[at] === MISSING ? null : {
          place: point(data, at, take),
          turn: [3, 4, 5, 6].map(function (k) { return data[at + k] / 32767 - 1; })
        });
      }
      poses.push(row);
      touching.push(contacts.slice(from, from + (machine.touching[f] || 0)));
      from += machine.touching[f] || 0;
    }
    return { origin: machine.origin, label: machine.label, poses: poses, touching: touching };
  });
  return { name: take.name, what: take.what, time: take.time, machines: machines, forces: take.forces };
}

// The frame before a time, and how far beyond it the time lies, 0 to 1.
function frameAt(time, t) {
  var low = 0, high = time.length - 1;
  while (high - low > 1) {
    var middle = (low + high) >> 1;
    if (time[middle] > t) { high = middle; } else { low = middle; }
  }
  var span = time[high] - time[low];
  return { frame: low, next: high, share: span > 0 ? Math.max(0, Math.min(1, (t - time[low]) / span)) : 0 };
}

// Poses of all parts of a machine at a place in time; null where it is missing.
function posesAt(machine, at) {
  return machine.poses[at.frame].map(function (pose, p) {
    var next = machine.poses[at.next][p];
    return pose && next ? between(pose, next, at.share) : null;
  });
}

function valueAt(values, at) {
  return values.length ? values[at.frame] + at.share * (values[at.next] - values[at.frame]) : 0;
}

// A ball around all that moves: the parts' shapes at some frames of an episode.
function ballAround(view, take) {
  var low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  // The first machine alone: a simulation may go astray.
  take.machines.slice(0, 1).forEach(function (machine) {
    var step = Math.max(1, machine.poses.length >> 5);
    for (var f = 0; machine.poses.length > f; f += step) {
      view.shapes.forEach(function (shape) {
        var pose = machine.poses[f][shape.part];
        if (shape.part === 0 || !pose) { return; }
        var reach = shape.reach, middle = add(pose.place, turned(pose.turn, shape.middle));
        for (var k = 0; k !== 3; k++) {
          low[k] = Math.min(low[k], middle[k] - reach);
          high[k] = Math.max(high[k], middle[k] + reach);
        }
      });
    }
  });
  if (low[0] > high[0]) { return { middle: [0, 0, 0], radius: 1, sides: [1, 1, 1] }; }
  var sides = subtract(high, low);
  return { middle: scaled(add(low, high), 0.5), radius: length(sides) / 2 || 1, sides: sides };
}
