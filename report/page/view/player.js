// A view on the page: canvas, time slider, what is shown, and which episode.

// Speeds that can be chosen; the first is the default.
var SPEEDS = [1, 0.5, 0.25, 0.1];

function choice(label, options) {
  return element('select', { 'aria-label': label }, options.map(function (text, i) { return element('option', { value: i }, [text]); }));
}

function Player(box) {
  var view = JSON.parse(box.querySelector('script').textContent);
  if (!view.takes.length) { return; }
  var canvas = element('canvas', { tabindex: 0, role: 'img', 'aria-label': 'The machine in 3-D: drag to turn it, the slider below sets the time' });
  var scene = Scene(canvas, view);
  if (!scene) { return; }
  var takes = view.takes.map(function (take) { return readTake(take, view.parts.length); });
  var ids = ['real', 'predicted', 'after', 'before', 'nominal'];
  var shown = { real: true, predicted: true, after: true, before: true, nominal: false, contacts: true, forces: true };
  var take = takes[0], ball, t = 0, playing = null, speed = SPEEDS[0], waiting = false;
  var camera = Camera(canvas, later);

  var play = element('button', { type: 'button' }, ['play']);
  var slider = element('input', { type: 'range', min: 0, step: 'any', 'aria-label': 'time' });
  var clock = element('output', {});
  var rates = choice('speed', SPEEDS.map(function (s) { return s + '×'; }));
  var episodes = choice('episode', takes.map(function (x) { return x.what ? x.name + ', ' + x.what : x.name; }));
  var home = element('button', { type: 'button' }, ['reset view']);
  var legend = element('div', { 'class': 'view-legend' }), scale = element('p', { 'class': 'view-scale' });
  box.replaceChildren(
    element('div', { 'class': 'view-bar' }, takes.length > 1 ? [legend, episodes] : [legend]), canvas,
    element('div', { 'class': 'view-time' }, [play, slider, clock, rates, home]), scale
  );

  function key(id, label, colour) {
    var tick = element('input', { type: 'checkbox' });
    tick.checked = shown[id];
    tick.addEventListener('change', function () { shown[id] = tick.checked; later(); });
    legend.append(element('label', { 'class': colour }, [tick, element('i', {}), label]));
  }

  function has(origin) { return take.machines.some(function (m) { return m.origin === origin; }); }

  // The machine that is drawn solid: the first that there is.
  function solid() { return ids.find(has); }

  function choose(index) {
    take = takes[index];
    take.machines.sort(function (a, b) { return ids.indexOf(a.origin) - ids.indexOf(b.origin); });
    if (take.machines.every(function (m) { return !shown[m.origin]; })) { shown[take.machines[0].origin] = true; }
    legend.replaceChildren();
    take.machines.forEach(function (m) { key(m.origin, m.label, m.origin === solid() ? 'solid' : 'ghost ' + m.origin); });
    if (take.machines.some(function (m) { return m.touching.some(function (p) { return p.length; }); })) {
      key('contacts', 'contact points', 'ghost contact');
    }
    scale.replaceChildren();
    take.largest = {};
    take.forces.forEach(function (f) {
      // What nine in ten of the largest force's moments stay below: a spike would leave nothing to see of the rest.
      var sizes = f.before.map(Math.abs).sort(function (a, b) { return a - b; }), most = sizes[Math.floor(0.9 * sizes.length)] || 0;
      take.largest[f.unit] = Math.max(take.largest[f.unit] || 0, most);
    });
    if (take.forces.length) {
      key('forces', 'missing force', 'arrow before');
      if (take.forces.some(function (f) { return f.after.length; })) { legend.append(element('span', { 'class': 'arrow after' }, [element('i', {}), 'what is left of it'])); }
      scale.append('Arrows at ' + take.forces.map(function (f) { return f.dof; }).join(', ') + '; the longest is ' +
        Object.keys(take.largest).map(function (u) { return take.largest[u].toPrecision(2) + ' ' + u; }).join(' or ') + ', or more.');
    }
    slider.max = take.time[take.time.length - 1];
    episodes.value = index;
    ball = ballAround(view, take);
    camera.frame(ball);
    to(Math.min(t, Number(slider.max)));
  }

  function to(time) {
    t = time;
    slider.value = t;
    clock.textContent = t.toFixed(2) + ' s';
    cursors.moment(take.name, t);
    later();
  }

  // From a click in a plot: its episode, where it is another one, and its time.
  function go(name, time) {
    var index = takes.findIndex(function (x) { return x.name === name; });
    if (index >= 0 && takes[index] !== take) { choose(index); }
    to(Math.max(0, Math.min(Number(slider.max), time)));
  }

  function later() {
    if (waiting || !ball) { return; }
    waiting = true;
    requestAnimationFrame(function () { waiting = false; render(); });
  }

  function render() {
    var density = Math.min(2, window.devicePixelRatio || 1);
    var wide = Math.round(canvas.clientWidth * density), high = Math.round(canvas.clientHeight * density);
    if (!wide || !high) { return; }
    if (canvas.width !== wide || canvas.height !== high) { canvas.width = wide; canvas.height = high; }
    var at = frameAt(take.time, t), eye = camera.eye(), first = solid(), colours = scene.colours(), contacts = [];
    var moment = { ball: ball, eye: eye, target: camera.target(), solid: [], ghosts: [], contacts: contacts, forces: [] };
    take.machines.forEach(function (machine) {
      var poses = posesAt(machine, at), seen = shown[machine.origin];
      if (machine.origin === first) { moment.solid = seen ? poses : []; moment.anchor = poses; }
      else if (seen) { moment.ghosts.push({ poses: poses, colour: colours[machine.origin] || colours.plain, far: distance(poses, eye) }); }
      if (machine.origin === first && seen && shown.contacts) { Array.prototype.push.apply(contacts, machine.touching[at.share > 0.5 ? at.next : at.frame]); }
    });
    // The farther ghost first, so that the nearer one is seen before it.
    moment.ghosts.sort(function (a, b) { return b.far - a.far; });
    if (shown.forces) {
      take.forces.forEach(function (f) {
        var most = take.largest[f.unit] || 1;
        moment.forces.push({ force: f, share: share(valueAt(f.before, at) / most), colour: colours.before, wider: 1 });
        moment.forces.push({ force: f, share: share(valueAt(f.after, at) / most), colour: colours.after, wider: 1.4 });
      });
    }
    scene.render(moment);
    canvas.dataset.drawn = t.toFixed(4);
  }

  function share(x) { return Math.max(-1, Math.min(1, x)); }

  function distance(poses, eye) {
    var there = poses.slice(1).filter(Boolean);
    return there.reduce(function (sum, p) { return sum + length(subtract(p.place, eye)); }, 0) / (there.length || 1);
  }

  function toggle() {
    if (playing) { cancelAnimationFrame(playing.frame); playing = null; play.textContent = 'play'; return; }
    if (t >= Number(slider.max)) { to(0); }
    playing = { last: performance.now() };
    play.textContent = 'pause';
    (function step(now) {
      to(Math.min(Number(slider.max), t + Math.max(0, (now || playing.last) - playing.last) / 1000 * speed));
      playing.last = now || playing.last;
      if (t >= Number(slider.max)) { toggle(); } else { playing.frame = requestAnimationFrame(step); }
    })();
  }

  play.addEventListener('click', toggle);
  slider.addEventListener('input', function () { to(Number(slider.value)); });
  rates.addEventListener('change', function () { speed = SPEEDS[rates.value]; });
  episodes.addEventListener('change', function () { choose(Number(episodes.value)); });
  home.addEventListener('click', camera.reset);
  canvas.addEventListener('keydown', function (event) {
    var step = { ArrowLeft: [-15, 0], ArrowRight: [15, 0], ArrowUp: [0, -15], ArrowDown: [0, 15] }[event.key];
    if (step) { camera.moved(step[0], step[1], event.shiftKey); }
    else if (event.key === ' ') { toggle(); }
    else if (event.key === '+') { camera.closer(0.9); }
    else if (event.key === '-') { camera.closer(1.1); }
    else { return; }
    event.preventDefault();
  });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', function () { scene.theme(); later(); });
  new ResizeObserver(later).observe(canvas);
  cursors.listen(go);
  choose(0);
}

document.querySelectorAll('.view').forEach(Player);
