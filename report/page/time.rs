//! Plots over time that zoom and tell values under the pointer, and that show the moment of the 3-D view.
//!
//! They are drawn as SVG, which prints and needs no script. Where scripts run, uPlot draws those that have a
//! clock ([`Chart::clock`](crate::plot::Chart::clock)) anew from that drawing, once they come in sight. It is the published
//! file, which `uplot/fetch.sh` puts beside this one, pinned and with its licence.

/// Style sheet of uPlot.
pub(super) const STYLE: &str = include_str!("time/uplot/uPlot.min.css");

/// uPlot, then what reads a drawing, what makes a plot of it, and what all plots of the page share.
const SCRIPTS: [&str; 4] = [
    include_str!("time/uplot/uPlot.iife.min.js"),
    include_str!("time/layers.js"),
    include_str!("time/timeplot.js"),
    include_str!("time/cursors.js"),
];

/// The scripts as one.
pub(super) fn scripts() -> String {
    SCRIPTS.join("\n")
}

/// Whether a page has plots over time.
pub(super) fn has_plots(html: &str) -> bool {
    html.contains(" data-clock=\"")
}
