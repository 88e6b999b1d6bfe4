// What a plot over time shows, read from its drawing: the drawing is what prints, and what is there without scripts.

// Numbers of an attribute.
function list(svg, name) { return (svg.getAttribute(name) || '').split(' ').map(Number); }

// Stretches of a path of absolute M, L, H, V and Z, in units of the drawing.
function stretches(d) {
  var all = [], at = null;
  (d.match(/[MLHVZ][^MLHVZ]*/g) || []).forEach(function (step) {
    var n = step.slice(1).trim().split(/[ ,]+/).map(Number);
    if (step[0] === 'Z') { return; }
    if (step[0] === 'M') { all.push([]); }
    at = step[0] === 'H' ? [n[0], at[1]] : step[0] === 'V' ? [at[0], n[0]] : [n[0], n[1]];
    all[all.length - 1].push(at);
  });
  return all;
}

// { x, y: ranges, label, layers }: a layer is a line, dots, or a shape that is only drawn (strokes, bands).
function readPlot(svg) {
  // First and last time of the box, and its left, top, right and bottom edge; then the range of its other axis.
  var box = list(svg, 'data-clock'), range = list(svg, 'data-range'), start = Number(svg.getAttribute('data-start'));
  var toData = function (p) {
    return [
      start + box[0] + (p[0] - box[2]) / (box[4] - box[2]) * (box[1] - box[0]),
      range[1] + (p[1] - box[3]) / (box[5] - box[3]) * (range[0] - range[1])
    ];
  };
  var layers = [];
  svg.querySelectorAll('g[clip-path] > *').forEach(function (mark) {
    var style = getComputedStyle(mark), name = mark.getAttribute('data-name') || '';
    if (mark.tagName === 'g') {
      var dots = Array.prototype.map.call(mark.querySelectorAll('circle'), function (c) {
        return toData([Number(c.getAttribute('cx')), Number(c.getAttribute('cy'))]);
      });
      dots.sort(function (a, b) { return a[0] - b[0]; });
      var radius = dots.length ? Number(mark.querySelector('circle').getAttribute('r')) : 2;
      layers.push({ kind: 'dots', name: name, colour: style.fill, opacity: style.fillOpacity, width: radius, stretches: [dots] });
      return;
    }
    var parts = stretches(mark.getAttribute('d') || '').map(function (s) { return s.map(toData); });
    var filled = mark.classList.contains('fill');
    // Strokes such as whiskers, and lines across the whole box, have no value at a time of their own.
    var values = parts.some(function (s) { return s.length > 2 || (s.length === 2 && s[0][0] !== s[1][0]); });
    var across = parts.length === 1 && parts[0].length === 2 && parts[0][0][1] === parts[0][1][1];
    layers.push({
      kind: filled ? 'band' : values && !across ? 'line' : 'strokes', name: name, stretches: parts,
      colour: filled ? style.fill : style.stroke, opacity: filled ? style.fillOpacity : style.strokeOpacity,
      width: parseFloat(style.strokeWidth) || 1.5, dash: (mark.getAttribute('stroke-dasharray') || '').split(' ').filter(Boolean).map(Number)
    });
  });
  return { x: [start + box[0], start + box[1]], y: range, start: start, label: svg.getAttribute('data-label') || '', layers: layers };
}

// Columns of lines and dots by common times: null interrupts a line, undefined is another series' time.
function columns(layers) {
  return uPlot.join(layers.map(function (layer) {
    var x = [], y = [];
    layer.stretches.forEach(function (stretch) {
      if (x.length && stretch.length) { x.push((x[x.length - 1] + stretch[0][0]) / 2); y.push(null); }
      stretch.forEach(function (p) {
        // The corner of a step: what holds from this time on.
        if (x.length && x[x.length - 1] === p[0]) { y[y.length - 1] = p[1]; } else { x.push(p[0]); y.push(p[1]); }
      });
    });
    return [x, y];
  }), layers.map(function () { return [1, 1]; }));
}
