// Draws a moment: what stands still, the machine, its ghosts, contact points, and forces.

// Direction towards the light: over the left shoulder of who looks from the front.
var LIGHT = unit([0.35, -0.5, 0.9]);
// Vertical angle of view, rad: a standard lens.
var ANGLE = 0.6;
// Length of the longest arrow, and radius of a round one, relative to the radius of what moves.
var LONGEST = 0.75, ROUND = 0.4;
// Sweep of the largest round arrow, rad.
var SWEEP = 4.7;

function colourOf(style, name) {
  var text = style.getPropertyValue(name).trim().replace('#', ''), n = parseInt(text, 16);
  return [(n >> 16 & 255) / 255, (n >> 8 & 255) / 255, (n & 255) / 255];
}

// Colours of the page, by what they are for.
function palette() {
  var style = getComputedStyle(document.documentElement), of = function (name) { return colourOf(style, name); };
  var dark = dot(of('--paper'), [1, 1, 1]) < 1.5;
  return {
    dark: dark, ground: of('--raised'), rule: of('--axis'), plain: dark ? [0.62, 0.66, 0.71] : [0.72, 0.75, 0.79],
    nominal: of('--soft'), before: of('--vermillion'), after: of('--blue'), contact: of('--purple'), shadow: [0, 0, 0]
  };
}

// Half the size of a shape along its axes, its middle in the part, and a ball that holds it.
function measure(shape, meshes) {
  var s = shape.size, size, middle = shape.position;
  if (shape.kind === 'sphere') { size = [s[0], s[0], s[0]]; }
  else if (shape.kind === 'capsule') { size = [s[0], s[0], s[0] + s[1]]; }
  else if (shape.kind === 'cylinder') { size = [s[0], s[0], s[1]]; }
  else if (shape.kind === 'mesh') {
    var mesh = meshes[shape.mesh], half = mesh.size / 2;
    size = [half, half, half];
    middle = add(shape.position, turned(shape.rotation, add(mesh.low, size)));
  } else { size = s.slice(); }
  shape.middle = middle;
  shape.reach = shape.kind === 'plane' ? 0 : length(size);
  shape.pose = { place: shape.position, turn: shape.rotation };
}

function Scene(canvas, view) {
  var gl = canvas.getContext('webgl2', { antialias: true, alpha: false, stencil: true, preserveDrawingBuffer: true });
  if (!gl) { return null; }
  var solids = program(gl, SOLID_VERTEX, SOLID_FRAGMENT), floors = program(gl, SOLID_VERTEX, FLOOR_FRAGMENT);
  var stock = {
    box: upload(gl, cube()), sphere: upload(gl, ball()), ellipsoid: null, cylinder: upload(gl, cylinder()),
    plane: upload(gl, square()), arrow: upload(gl, arrow(0.022))
  };
  stock.ellipsoid = stock.sphere;
  var meshes = view.meshes.map(function (mesh) { return upload(gl, meshSolid(mesh)); });
  view.shapes.forEach(function (shape) {
    measure(shape, view.meshes);
    var s = shape.size;
    // What is uploaded is of unit size but for capsules and meshes, which keep their proportions.
    if (shape.kind === 'capsule') { shape.drawn = upload(gl, capsule(s[0], s[1])); shape.scale = [1, 1, 1]; }
    else if (shape.kind === 'mesh') { shape.drawn = meshes[shape.mesh]; shape.scale = [1, 1, 1]; }
    else {
      shape.drawn = stock[shape.kind];
      shape.scale = shape.kind === 'sphere' ? [s[0], s[0], s[0]] : shape.kind === 'cylinder' ? [s[0], s[0], s[1]] : s;
    }
  });
  var colours = palette(), ring = null;

  function draw(uploaded, pose, scale, more) {
    more.model = more.flatten ? product(more.flatten, poseMatrix(pose, scale)) : poseMatrix(pose, scale);
    more.size = scale;
    set(gl, solids, more);
    gl.bindVertexArray(uploaded.array);
    gl.drawArrays(gl.TRIANGLES, 0, uploaded.count);
  }

  // The shapes of a machine; `colour` in place of their own where it is given.
  function machine(poses, colour, more) {
    view.shapes.forEach(function (shape) {
      var pose = poses[shape.part];
      if (shape.part === 0 || !pose || shape.kind === 'plane') { return; }
      var own = shape.rgba || colours.plain.concat(1);
      more.colour = colour || own;
      if (more.colour[3] > 0.02) { draw(shape.drawn, within(pose, shape.pose), shape.scale, more); }
    });
  }

  function still() {
    view.shapes.forEach(function (shape) {
      if (shape.part !== 0 || shape.kind === 'plane') { return; }
      var own = shape.rgba || colours.plain.concat(1);
      draw(shape.drawn, shape.pose, shape.scale, { colour: own, ghost: 0, flatness: 0 });
    });
  }

  // Floors of the scene; where it has none, a grid below all that moves.
  function floor(ball) {
    gl.useProgram(floors.program);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 2);
    var reach = 5 * ball.radius, exponent = Math.pow(10, Math.floor(Math.log10(ball.radius)));
    var cell = exponent * (ball.radius / exponent > 5 ? 2 : ball.radius / exponent > 2 ? 1 : 0.5);
    var planes = view.shapes.filter(function (s) { return s.kind === 'plane' && s.part === 0; });
    var lone = { place: [ball.middle[0], ball.middle[1], ball.middle[2] - ball.sides[2] / 2 - 0.02 * ball.radius], turn: [1, 0, 0, 0] };
    (planes.length ? planes : [{ pose: lone, size: [0, 0, 0], none: true }]).forEach(function (plane) {
      var side = function (s) { return s > 0 && s < reach ? s : reach; };
      var own = plane.rgba || colours.plain.concat(1), scale = [side(plane.size[0]), side(plane.size[1]), 1];
      // A plane without an end is drawn around what moves.
      var pose = { place: plane.pose.place, turn: plane.pose.turn };
      if (!(plane.size[0] > 0 && plane.size[0] < reach)) {
        var normal = turned(pose.turn, [0, 0, 1]);
        pose.place = subtract(ball.middle, scaled(normal, dot(subtract(ball.middle, pose.place), normal)));
      }
      set(gl, floors, {
        model: poseMatrix(pose, scale), size: scale, middle: ball.middle, reach: reach, cell: cell,
        colour: own.slice(0, 3).concat(plane.none ? 0 : colours.dark ? 0.22 : 0.4 * own[3]), ruled: colours.rule.concat(plane.none ? 0.28 : 0.5)
      });
      gl.bindVertexArray(stock.plane.array);
      gl.drawArrays(gl.TRIANGLES, 0, stock.plane.count);
    });
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.useProgram(solids.program);
    return planes.length ? planes[0].pose : null;
  }

  // Darkens a level floor once where anything stands between it and the light.
  function shadow(poses, plane) {
    if (!plane || turned(plane.turn, [0, 0, 1])[2] < 0.999) { return; }
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    gl.depthMask(false);
    machine(poses, colours.shadow.concat(colours.dark ? 0.4 : 0.16), {
      flatten: shadowMatrix(LIGHT, plane.place[2] + 1e-4), ghost: 0, flatness: 1
    });
    gl.depthMask(true);
    gl.disable(gl.STENCIL_TEST);
  }

  // A machine that one sees through: its depth first, so that only its front is seen.
  function ghost(poses, colour) {
    gl.enable(gl.POLYGON_OFFSET_FILL);
    // Behind what it coincides with, so that a ghost tints nothing that it agrees with.
    gl.polygonOffset(1, 2);
    gl.colorMask(false, false, false, false);
    machine(poses, colour.concat(1), { ghost: 1, flatness: 0 });
    gl.colorMask(true, true, true, true);
    machine(poses, colour.concat(1), { ghost: 1, flatness: 0 });
    gl.disable(gl.POLYGON_OFFSET_FILL);
  }

  // A force at a part, `share` of the largest.
  function force(f, poses, share, colour, ball, wider) {
    var pose = poses[f.part];
    if (!pose || Math.abs(share) < 0.01) { return; }
    var place = add(pose.place, turned(pose.turn, f.at)), axis = f.in_world ? f.axis : turned(pose.turn, f.axis);
    var z = share < 0 && !f.turns ? scaled(axis, -1) : axis, x = across(z), y = cross(z, x);
    var more = { colour: colour.concat(1), ghost: 0, flatness: 0 };
    if (f.turns) {
      if (ring) { discard(gl, ring); }
      ring = upload(gl, ringArrow(0.05 * wider, SWEEP * share));
      drawAlong(ring, place, [x, y, z], ROUND * ball.radius * (wider > 1 ? 1 : 0.86), more);
    } else {
      var long = LONGEST * ball.radius * Math.abs(share);
      drawAlong(stock.arrow, place, [scaled(x, wider * LONGEST * ball.radius), scaled(y, wider * LONGEST * ball.radius), scaled(z, long)], 1, more);
    }
  }

  function drawAlong(uploaded, place, axes, size, more) {
    var a = axes.map(function (v) { return scaled(v, size); });
    more.model = [].concat(a[0], 0, a[1], 0, a[2], 0, place, 1);
    more.size = [1, 1, 1];
    set(gl, solids, more);
    gl.bindVertexArray(uploaded.array);
    gl.drawArrays(gl.TRIANGLES, 0, uploaded.count);
  }

  return {
    colours: function () { return colours; },
    theme: function () { colours = palette(); },
    // moment: { ball, eye, target, solid (poses), ghosts [{ poses, colour }], contacts, forces [{ f, share, colour, wider }] }
    render: function (moment) {
      var wide = canvas.width, high = canvas.height, away = length(subtract(moment.eye, moment.target)), ball = moment.ball;
      gl.viewport(0, 0, wide, high);
      gl.clearColor(colours.ground[0], colours.ground[1], colours.ground[2], 1);
      gl.enable(gl.DEPTH_TEST);
      gl.depthFunc(gl.LEQUAL);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
      var camera = product(perspective(ANGLE, wide / high, away / 60, away + 40 * ball.radius), lookAt(moment.eye, moment.target));
      var shared = { camera: camera, eye: moment.eye, light: LIGHT };
      gl.useProgram(floors.program);
      set(gl, floors, shared);
      gl.useProgram(solids.program);
      set(gl, solids, shared);
      still();
      machine(moment.solid, null, { ghost: 0, flatness: 0 });
      shadow(moment.solid, floor(ball));
      moment.ghosts.forEach(function (g) { ghost(g.poses, g.colour); });
      gl.disable(gl.DEPTH_TEST);
      moment.contacts.forEach(function (p) {
        var r = 0.009 * away * ANGLE;
        draw(stock.sphere, { place: p, turn: [1, 0, 0, 0] }, [r, r, r], { colour: colours.contact.concat(0.9), ghost: 0, flatness: 1 });
      });
      gl.enable(gl.DEPTH_TEST);
      gl.clear(gl.DEPTH_BUFFER_BIT);
      moment.forces.forEach(function (f) { force(f.force, moment.solid, f.share, f.colour, ball, f.wider); });
    }
  };
}
