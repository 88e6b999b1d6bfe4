// A camera that goes around a point: turned by dragging, moved with the right button or shift, closer by the wheel.

// Radians a pixel of dragging.
var TURNING = 0.007;
// Closer and farther by this much a notch of the wheel.
var NOTCH = 1.0012;

function Camera(canvas, changed) {
  var target, away, round, above, home, pressed = {}, spread = 0;

  // Looks at a ball; a machine that moves in a plane is seen from its side.
  function frame(ball) {
    var s = ball.sides, thin = 0.35 * Math.max(s[0], s[1], s[2]);
    home = { target: ball.middle, away: 0.76 * ball.radius / Math.sin(ANGLE / 2), round: -0.9, above: 0.36 };
    if (s[1] < thin && s[1] <= s[0]) { home.round = -Math.PI / 2 + 0.3; home.above = 0.2; }
    else if (s[0] < thin) { home.round = -0.3; home.above = 0.2; }
    reset();
  }

  function reset() {
    target = home.target;
    away = home.away;
    round = home.round;
    above = home.above;
    changed();
  }

  function direction() { return [Math.cos(above) * Math.cos(round), Math.cos(above) * Math.sin(round), Math.sin(above)]; }

  function closer(factor) {
    away = Math.max(home.away / 40, Math.min(home.away * 6, away * factor));
    changed();
  }

  function moved(dx, dy, shift) {
    if (shift) {
      var back = direction(), right = unit(cross([0, 0, 1], back)), up = cross(back, right);
      var step = away * ANGLE / canvas.clientHeight;
      target = add(target, add(scaled(right, -dx * step), scaled(up, dy * step)));
    } else {
      round -= dx * TURNING;
      above = Math.max(-1.5, Math.min(1.5, above + dy * TURNING));
    }
    changed();
  }

  function apart() {
    var p = Object.keys(pressed).map(function (k) { return pressed[k]; });
    return p.length === 2 ? Math.hypot(p[0].x - p[1].x, p[0].y - p[1].y) : 0;
  }

  canvas.addEventListener('pointerdown', function (event) {
    pressed[event.pointerId] = { x: event.clientX, y: event.clientY, shift: event.shiftKey || event.button === 2 };
    spread = apart();
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener('pointermove', function (event) {
    var last = pressed[event.pointerId];
    if (!last) { return; }
    var dx = event.clientX - last.x, dy = event.clientY - last.y;
    last.x = event.clientX;
    last.y = event.clientY;
    if (spread > 0) {
      var now = apart();
      if (now > 0) { closer(spread / now); spread = now; }
    } else { moved(dx, dy, last.shift); }
  });
  ['pointerup', 'pointercancel'].forEach(function (name) {
    canvas.addEventListener(name, function (event) { delete pressed[event.pointerId]; spread = 0; });
  });
  canvas.addEventListener('contextmenu', function (event) { event.preventDefault(); });
  canvas.addEventListener('dblclick', reset);
  // A page is scrolled by the wheel; only a view that was clicked is zoomed by it.
  canvas.addEventListener('wheel', function (event) {
    if (document.activeElement !== canvas && !event.ctrlKey) { return; }
    event.preventDefault();
    closer(Math.pow(NOTCH, event.deltaY));
  }, { passive: false });

  return {
    frame: frame, reset: reset, moved: moved, closer: closer,
    target: function () { return target; },
    eye: function () { return add(target, scaled(direction(), away)); }
  };
}
