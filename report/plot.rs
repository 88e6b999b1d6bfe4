//! Plots as SVG text, with no script, no font file and no fixed colour.
//!
//! A plot is a plain value that knows its data; [`Plot::svg`] lays it out for one width. Widths are
//! in SVG units. [`NARROW`] is drawn at about one unit a pixel beside another plot and is readable
//! at 380 px; [`WIDE`] fills a whole row on a desktop screen. Text sizes are fixed in these units,
//! so a wide plot has a new layout instead of a larger scale.
//!
//! Colours are CSS classes (`c-blue`, …) that set `--c`; [`crate::page`] holds the values for light
//! and dark pages. They are the Okabe-Ito hues, which people with any common colour blindness can
//! distinguish. They are darkened or lightened until text in them has a contrast of 4.5 to 1.
//!
//! Text never overlaps. The axis label and the legend flow in rows above the plot, labels of marker
//! lines are put into lanes below them, and ticks are thinned until they fit.

mod chart;
mod clock;
mod density;
mod frame;
mod header;
mod heat;
mod layer;
mod marks;
mod outline;
mod panels;
mod plan;
mod ranking;
mod scale;

pub use chart::Chart;
pub(crate) use density::grid;
pub use density::{Density, Weighted};
pub use frame::Axis;
pub use heat::Heat;
pub use layer::{Dash, Layer};
pub use outline::Outline;
pub use panels::Panels;
pub use plan::Plan;
pub use ranking::{Ranked, Ranking};
pub use scale::{Scale, Spacing, Ticks};

/// Width of a plot beside another one, in SVG units.
pub const NARROW: f64 = 420.0;
/// Width of a plot with a row to itself, in SVG units.
pub const WIDE: f64 = 880.0;
/// Size of all text in a plot, in SVG units.
pub const FONT_SIZE: f64 = 12.5;

/// Something that can be drawn as one SVG element.
pub trait Plot {
    /// The SVG element, `width` units wide and as high as necessary.
    ///
    /// `id` prefixes every identifier in it and must be unique on the page.
    fn svg(&self, id: &str, width: f64) -> String;
}

impl<P: Plot + ?Sized> Plot for std::sync::Arc<P> {
    fn svg(&self, id: &str, width: f64) -> String {
        (**self).svg(id, width)
    }
}

/// A colour by its role in the palette; the page defines the value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Colour {
    /// Text colour: measured reality and truth.
    #[default]
    Ink,
    /// Grey: prior belief, context.
    Muted,
    /// Blue: what was identified.
    Blue,
    /// Vermillion: moving things, or a warning.
    Vermillion,
    /// Green: goals and success.
    Green,
    /// Purple.
    Purple,
    /// Ochre.
    Ochre,
    /// The first of four levels from low to high.
    Cool,
    /// The second.
    Warm,
    /// The third.
    Hot,
    /// The fourth.
    Fierce,
}

impl Colour {
    /// The CSS class that sets `--c` to this colour.
    #[must_use]
    pub const fn class(self) -> &'static str {
        match self {
            Self::Ink => "c-ink",
            Self::Muted => "c-muted",
            Self::Blue => "c-blue",
            Self::Vermillion => "c-vermillion",
            Self::Green => "c-green",
            Self::Purple => "c-purple",
            Self::Ochre => "c-ochre",
            Self::Cool => "c-cool",
            Self::Warm => "c-warm",
            Self::Hot => "c-hot",
            Self::Fierce => "c-fierce",
        }
    }
}

/// A coordinate with at most two decimals.
pub(crate) fn coordinate(value: f64) -> String {
    let text = format!("{value:.2}");
    let trimmed = text.trim_end_matches('0').trim_end_matches('.');
    if trimmed == "-0" {
        "0".to_owned()
    } else {
        trimmed.to_owned()
    }
}

/// The root element, with title and description for screen readers.
pub(crate) fn root(id: &str, size: [f64; 2], title: &str, description: &str, body: &str) -> String {
    use crate::markup::escape;
    let [width, height] = size;
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"plot\" viewBox=\"0 0 {w} {h}\" role=\"img\" \
         aria-labelledby=\"{id}-t {id}-d\" font-size=\"{FONT_SIZE}\">\
         <title id=\"{id}-t\">{t}</title><desc id=\"{id}-d\">{d}</desc>{body}</svg>",
        w = coordinate(width),
        h = coordinate(height.ceil()),
        id = escape(id),
        t = escape(title),
        d = escape(description),
    )
}
