//! Plots over time that zoom, show the values under the pointer, and mark the time of the 3-D view.
//!
//! They are drawn as SVG, which prints and needs no script. Where scripts run, uPlot redraws those
//! with a clock ([`Chart::clock`](crate::plot::Chart::clock)) from that SVG when they scroll into
//! view. uPlot is the published file, which `uplot/fetch.sh` puts beside this one, pinned and with
//! its licence.

/// Style sheet of uPlot.
pub(super) const STYLE: &str = include_str!("time/uplot/uPlot.min.css");

/// uPlot, then the scripts that read a drawing, make a plot from it, and hold what all plots of the
/// page share.
const SCRIPTS: [&str; 4] = [
    include_str!("time/uplot/uPlot.iife.min.js"),
    include_str!("time/layers.js"),
    include_str!("time/timeplot.js"),
    include_str!("time/cursors.js"),
];

/// The scripts, concatenated.
pub(super) fn scripts() -> String {
    SCRIPTS.join("\n")
}

/// Whether a page has plots over time.
pub(super) fn has_plots(html: &str) -> bool {
    html.contains(" data-clock=\"")
}
