// A plot over time that zooms and tells values under the pointer, by uPlot, in the place of its drawing.

// Room for labels, pixels, as the drawing has it.
var GUTTER = 50, BELOW = 26, RIGHT = 10, TEXT = '12px system-ui, sans-serif';
// Pixels that a click may move.
var STEADY = 3;

function see(colour, opacity) {
  var n = colour.match(/[\d.]+/g) || [0, 0, 0];
  return 'rgba(' + n.slice(0, 3).join(',') + ',' + (opacity === '' ? 1 : opacity) + ')';
}

// The nearest row that a series has a value at; its own times may not be another's.
function nearest(u, series, row) {
  var values = u.data[series], far = values.length;
  for (var k = 0; row !== null && far > k; k++) {
    if (typeof values[row - k] === 'number') { return row - k; }
    if (typeof values[row + k] === 'number') { return row + k; }
  }
  return row;
}

function short(x) { return x === null || x === undefined ? '' : String(Number(x.toPrecision(4))).replace('-', '\u2212'); }

// Draws what has no values of its own.
function shapes(layers) {
  return function (u) {
    var c = u.ctx, ratio = devicePixelRatio || 1;
    c.save();
    c.beginPath();
    c.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
    c.clip();
    layers.forEach(function (layer) {
      c.beginPath();
      layer.stretches.forEach(function (stretch) {
        stretch.forEach(function (p, i) {
          var x = u.valToPos(p[0], 'x', true), y = u.valToPos(p[1], 'y', true);
          if (i) { c.lineTo(x, y); } else { c.moveTo(x, y); }
        });
      });
      if (layer.kind === 'band') { c.fillStyle = see(layer.colour, layer.opacity); c.fill(); return; }
      c.strokeStyle = see(layer.colour, layer.opacity);
      c.lineWidth = layer.width * ratio;
      c.setLineDash((layer.dash || []).map(function (d) { return d * ratio; }));
      c.stroke();
    });
    c.restore();
  };
}

function TimePlot(svg, go) {
  var plot = readPlot(svg), named = plot.layers.filter(function (l) { return l.kind === 'line' || l.kind === 'dots'; });
  if (!named.length) { return null; }
  var mute = plot.layers.filter(function (l) { return l.kind === 'band' || l.kind === 'strokes'; });
  var holder = element('div', { 'class': 'timeplot' }), line = element('div', { 'class': 'moment' }), down = null;
  var paper = getComputedStyle(document.documentElement), of = function (name) { return paper.getPropertyValue(name).trim(); };
  var whole = function (u) { return u.scales.x.min <= plot.x[0] && u.scales.x.max >= plot.x[1]; };
  var axis = { font: TEXT, stroke: of('--soft'), ticks: { show: false }, grid: { stroke: of('--grid'), width: 1 } };
  var options = {
    width: svg.clientWidth, height: Math.max(90, svg.clientHeight - 24), padding: [6, RIGHT, 0, 0],
    scales: {
      x: { time: false, range: function (u, low, high) { return [Math.max(low, plot.x[0]), Math.min(high, plot.x[1])]; } },
      // Zoomed in, what is in sight fills the box, but not what left it before.
      y: { range: function (u, low, high) {
        if (low === null || whole(u)) { return plot.y; }
        var room = 0.06 * (high - low) || 0.1 * (plot.y[1] - plot.y[0]);
        return [Math.max(plot.y[0], low - room), Math.min(plot.y[1], high + room)];
      } }
    },
    axes: [
      Object.assign({ size: BELOW, gap: 4 }, axis, { grid: { show: false } }),
      Object.assign({ size: GUTTER, gap: 5, values: function (u, all) { return all.map(short); } }, axis)
    ],
    cursor: { sync: { key: svg.getAttribute('data-take') || 'all', scales: ['x', null] }, drag: { x: true, y: false, dist: STEADY }, y: false, points: { size: 5 }, dataIdx: nearest },
    legend: { live: true, markers: {
      width: 2, dash: function (u, i) { return i && named[i - 1].dash && named[i - 1].dash.length ? 'dashed' : 'solid'; },
      stroke: function (u, i) { return i ? see(named[i - 1].colour, named[i - 1].opacity) : 'transparent'; },
      fill: function (u, i) { return i && named[i - 1].kind === 'dots' ? see(named[i - 1].colour, named[i - 1].opacity) : 'transparent'; }
    } },
    series: [{ label: 'time', value: function (u, x) { return short(x) + (x === null || x === undefined ? '' : ' s'); } }].concat(named.map(function (layer) {
      var dots = layer.kind === 'dots', colour = see(layer.colour, layer.opacity);
      return {
        label: layer.name || plot.label, stroke: colour, width: dots ? 0 : layer.width, dash: layer.dash && layer.dash.length ? layer.dash : undefined,
        paths: dots ? function () { return null; } : undefined, points: dots ? { show: true, size: 2 * layer.width, fill: colour, width: 0 } : { show: false },
        value: function (u, y) { return short(y); }
      };
    })),
    hooks: { drawClear: [shapes(mute.filter(function (l) { return l.kind === 'band'; }))], draw: [shapes(mute.filter(function (l) { return l.kind !== 'band'; }))] }
  };
  var u = new uPlot(options, columns(named), holder), now = null;
  holder.prepend(element('p', { 'class': 'axis-label' }, [plot.label]));
  u.over.append(line);
  u.over.addEventListener('mousedown', function (event) { down = event.clientX; });
  u.over.addEventListener('click', function (event) {
    if (down === null || Math.abs(event.clientX - down) > STEADY) { return; }
    go(svg.getAttribute('data-take'), u.posToVal(event.clientX - u.over.getBoundingClientRect().left, 'x') - plot.start);
  });
  svg.after(holder);
  svg.classList.add('drawn-anew');

  function moment(t) {
    now = t;
    var x = t === null ? -1 : u.valToPos(t + plot.start, 'x');
    line.hidden = !(x >= 0 && x <= u.over.clientWidth);
    line.style.transform = 'translateX(' + x + 'px)';
    // Values of the moment, as long as no pointer asks for others.
    if (t !== null && (u.cursor.left === undefined || u.cursor.left < 0)) {
      var row = u.valToIdx(t + plot.start);
      u.setLegend({ idxs: u.series.map(function (s, i) { return i ? nearest(u, i, row) : row; }) });
    }
  }
  ['setScale', 'ready'].forEach(function (hook) { u.hooks[hook] = [function () { moment(now); }]; });

  return {
    moment: moment,
    resize: function () { if (holder.clientWidth) { u.setSize({ width: holder.clientWidth, height: options.height }); moment(now); } },
    destroy: function () { u.destroy(); holder.remove(); svg.classList.remove('drawn-anew'); }
  };
}
