// A line in every plot over time that shows the moment of the view; a click in a plot goes to its moment.

function Cursors(go) {
  var plots = Array.prototype.map.call(document.querySelectorAll('svg[data-clock]'), function (svg) {
    // First and last time of the box, then its left, top, right and bottom edge in the drawing's units.
    var box = svg.getAttribute('data-clock').split(' ').map(Number);
    var line = document.createElementNS('http://www.w3.org/2000/svg', 'path');
    line.setAttribute('class', 'cursor');
    svg.appendChild(line);
    svg.addEventListener('click', function (event) {
      var frame = svg.getBoundingClientRect(), x = (event.clientX - frame.left) / frame.width * svg.viewBox.baseVal.width;
      var share = (x - box[2]) / (box[4] - box[2]);
      if (share >= 0 && share <= 1) { go(svg.getAttribute('data-take'), box[0] + share * (box[1] - box[0])); }
    });
    svg.classList.add('timed');
    return { take: svg.getAttribute('data-take'), box: box, line: line };
  });
  return function (take, t) {
    plots.forEach(function (plot) {
      var b = plot.box, x = b[2] + (t - b[0]) / (b[1] - b[0]) * (b[4] - b[2]);
      var inside = (plot.take === take || plot.take === '') && x >= b[2] - 0.01 && x <= b[4] + 0.01;
      plot.line.setAttribute('d', inside ? 'M' + x.toFixed(2) + ' ' + b[3] + 'V' + b[5] : '');
    });
  };
}
