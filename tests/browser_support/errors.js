// Whatever goes wrong on the page, in the order in which it does.
window.wrong = [];
window.addEventListener('error', function (event) { window.wrong.push(String(event.message)); });
window.addEventListener('unhandledrejection', function (event) { window.wrong.push(String(event.reason)); });
['error', 'warn'].forEach(function (kind) {
  var said = console[kind];
  console[kind] = function () { window.wrong.push(Array.prototype.join.call(arguments, ' ')); said.apply(console, arguments); };
});
// A page without a window is asked for few frames, whatever its clock says: here they come by the clock.
window.requestAnimationFrame = function (draw) { return setTimeout(function () { draw(performance.now()); }, 16); };
window.cancelAnimationFrame = clearTimeout;
