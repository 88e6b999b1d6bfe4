// Plays with the view of a report as a reader would, and writes what was seen between two marks.
(async function () {
  var seen = { wrong: window.wrong };
  function drawn() {
    return new Promise(function (done) { requestAnimationFrame(function () { requestAnimationFrame(done); }); });
  }
  try {
    await drawn();
    var canvas = document.querySelector('.view canvas'), slider = document.querySelector('.view input[type=range]');
    var copy = document.createElement('canvas').getContext('2d', { willReadFrequently: true });
    var pixels = function () {
      copy.canvas.width = canvas.width;
      copy.canvas.height = canvas.height;
      copy.drawImage(canvas, 0, 0);
      return copy.getImageData(0, 0, canvas.width, canvas.height).data;
    };
    // Pixels that differ by more than rounding does.
    var changed = function (a, b) {
      var count = 0;
      for (var i = 0; i < a.length; i += 4) {
        if (Math.abs(a[i] - b[i]) + Math.abs(a[i + 1] - b[i + 1]) + Math.abs(a[i + 2] - b[i + 2]) > 24) { count++; }
      }
      return count;
    };
    var to = async function (t) {
      slider.value = t;
      slider.dispatchEvent(new Event('input'));
      await drawn();
      return pixels();
    };
    var cursors = function () {
      return Array.prototype.map.call(document.querySelectorAll('.timeplot .moment'), function (line) {
        return line.hidden ? '' : line.style.transform;
      });
    };
    // A plot of the episode that is shown, made to zoom once it comes in sight.
    var episodes = document.querySelector('.view-bar select'), shown = episodes ? episodes.options[0].textContent : '';
    var svg = Array.prototype.find.call(document.querySelectorAll('svg[data-clock]'), function (s) {
      return s.clientWidth > 0 && (!shown || shown.split(',')[0] === s.getAttribute('data-take'));
    });
    var live = function () { return svg && svg.nextElementSibling && svg.nextElementSibling.querySelector('.u-over'); };
    for (var wait = 0; svg && wait < 200 && !live(); wait++) {
      svg.scrollIntoView();
      await drawn();
    }
    var end = Number(slider.max), colours = new Set();
    var first = await to(0), before = cursors();
    for (var i = 0; i < first.length; i += 4) { colours.add(first[i] << 16 | first[i + 1] << 8 | first[i + 2]); }
    var corner = [first[0], first[1], first[2]];
    var middle = await to(end / 2), after = cursors(), again = await to(0);
    Object.assign(seen, {
      pixels: first.length / 4, colours: colours.size, corner: corner, end: end,
      moved: changed(first, middle), same: changed(first, again),
      lines: after.filter(Boolean).length,
      linesMoved: after.filter(function (d, k) { return d && d !== before[k]; }).length
    });
    // Each machine away and back.
    seen.legend = [];
    for (var label of document.querySelectorAll('.view-legend label')) {
      var tick = label.querySelector('input'), name = label.textContent, whole = await to(end / 2);
      tick.click();
      await drawn();
      seen.legend.push({ name: name, changed: changed(whole, pixels()) });
      tick.click();
    }
    // Dragged by a hand's breadth.
    var still = await to(0), hold = function (kind, x) {
      var at = { pointerId: 1, clientX: x, clientY: 200, button: 0, bubbles: true };
      try { canvas.dispatchEvent(new PointerEvent(kind, at)); } catch (e) { seen.wrong.push(String(e)); }
    };
    canvas.setPointerCapture = function () {};
    hold('pointerdown', 300);
    hold('pointermove', 420);
    hold('pointerup', 420);
    await drawn();
    seen.turned = changed(still, pixels());
    // A plot: values at the moment, a click at six tenths, and a stretch that is dragged over.
    var over = live();
    if (over) {
      var box = over.getBoundingClientRect(), mouse = function (kind, share, on) {
        var at = { clientX: box.left + share * box.width, clientY: box.top + box.height / 2, button: 0, buttons: 1, movementX: 1, bubbles: true };
        (on || over).dispatchEvent(new MouseEvent(kind, at));
      };
      var said = function () { return over.closest('.timeplot').querySelector('.u-legend').textContent; };
      var axis = function () { return over.closest('.uplot').querySelector('canvas').toDataURL(); };
      mouse('mousedown', 0.6);
      mouse('mouseup', 0.6, document);
      mouse('click', 0.6);
      await drawn();
      seen.clicked = Number(slider.value);
      seen.values = said();
      mouse('mousemove', 0.3);
      await drawn();
      seen.pointed = said();
      var wide = axis();
      mouse('mousedown', 0.2);
      mouse('mousemove', 0.4);
      await drawn();
      mouse('mouseup', 0.4, document);
      await drawn();
      seen.zoomed = axis() !== wide;
      over.dispatchEvent(new MouseEvent('dblclick', { bubbles: true }));
    }
    // Every other episode is drawn too.
    seen.episodes = [];
    for (var k = 0; episodes && k < episodes.options.length; k++) {
      episodes.value = k;
      episodes.dispatchEvent(new Event('change'));
      var start = await to(Number(slider.min)), half = await to(Number(slider.max) / 2);
      seen.episodes.push({
        name: episodes.options[k].textContent, moved: changed(start, half), legend: document.querySelector('.view-legend').textContent
      });
    }
  } catch (e) {
    seen.wrong.push(String(e && e.stack || e));
  }
  var out = document.createElement('pre');
  out.textContent = 'PROBED' + ':' + JSON.stringify(seen) + ':' + 'DEBORP';
  document.body.appendChild(out);
})();
