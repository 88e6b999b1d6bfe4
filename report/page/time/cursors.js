// All plots over time of the page: each is made to zoom once it comes in sight, and shows the moment of the 3-D view.

function element(name, attributes, inner) {
  var made = document.createElement(name);
  Object.keys(attributes).forEach(function (key) { made.setAttribute(key, attributes[key]); });
  (inner || []).forEach(function (part) { made.append(part); });
  return made;
}

function Cursors() {
  var take = null, t = 0, goes = null;
  var plots = Array.prototype.map.call(document.querySelectorAll('svg[data-clock]'), function (svg) {
    return { svg: svg, take: svg.getAttribute('data-take'), live: null };
  });
  var go = function (name, time) { if (goes) { goes(name, time); } };
  var show = function (plot) {
    if (plot.live) { plot.live.moment(take !== null && (plot.take === take || plot.take === '') ? t : null); }
  };
  var wake = function (plot) {
    if (!plot.live && plot.svg.clientWidth > 0) { plot.live = TimePlot(plot.svg, go); show(plot); }
  };
  var sleep = function () {
    plots.forEach(function (plot) {
      if (plot.live) { plot.live.destroy(); plot.live = null; observer.unobserve(plot.svg); observer.observe(plot.svg); }
    });
  };
  var observer = new IntersectionObserver(function (entries) {
    entries.forEach(function (entry) {
      if (entry.isIntersecting) { wake(plots.find(function (plot) { return plot.svg === entry.target; })); }
    });
  }, { rootMargin: '300px' });
  plots.forEach(function (plot) { observer.observe(plot.svg); });
  // Colours and sizes are of the page: the plots are made anew with them.
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', sleep);
  var width = innerWidth;
  addEventListener('resize', function () { if (innerWidth !== width) { width = innerWidth; sleep(); } });

  return {
    // Calls back with an episode and a time when a plot is clicked.
    listen: function (callback) { goes = callback; },
    // The episode and time that are shown.
    moment: function (name, time) { take = name; t = time; plots.forEach(show); }
  };
}

var cursors = Cursors();
