//! The layers of a chart: one for each series, drawn in the order given.

use super::Colour;

/// Dash pattern of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Dash {
    /// Unbroken.
    #[default]
    Solid,
    /// Long dashes.
    Dashed,
    /// Short dots.
    Dotted,
}

impl Dash {
    pub(crate) const fn attribute(self) -> &'static str {
        match self {
            Self::Solid => "",
            Self::Dashed => " stroke-dasharray=\"6 4\"",
            Self::Dotted => " stroke-dasharray=\"1.5 3.5\" stroke-linecap=\"round\"",
        }
    }
}

/// The geometry of a layer, in data units.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Mark {
    /// Connected points `[x, y]`, interrupted at non-finite ones.
    Line(Vec<[f64; 2]>),
    /// Like a line, but each value holds until the next point.
    Steps(Vec<[f64; 2]>),
    /// `[x, low, high]`.
    Band(Vec<[f64; 3]>),
    /// Filled from zero to `[x, y]`.
    Area(Vec<[f64; 2]>),
    /// Points `[x, y]` with a radius in SVG units.
    Dots(Vec<[f64; 2]>, f64),
    /// Vertical strokes `[x, low, high]`.
    Whiskers(Vec<[f64; 3]>),
    /// `[x0, x1, y]`, filled from zero.
    Bars(Vec<[f64; 3]>),
    /// A line over the full height at `x`, labelled above the plot.
    Vertical(f64),
    /// A line over the full width at `y`.
    Horizontal(f64),
    /// Shading over the full height between two `x`.
    Span(f64, f64, String),
}

/// One series of a chart.
///
/// ```
/// use asid_report::plot::{Colour, Layer};
/// let truth = Layer::vertical(0.06).colour(Colour::Ink).label("truth 0.060").dashed();
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    pub(crate) mark: Mark,
    pub(crate) colour: Colour,
    pub(crate) label: Option<String>,
    pub(crate) dash: Dash,
    pub(crate) opacity: f64,
    pub(crate) width: Option<f64>,
}

impl Layer {
    fn new(mark: Mark) -> Self {
        Self {
            mark,
            colour: Colour::Ink,
            label: None,
            dash: Dash::Solid,
            opacity: 1.0,
            width: None,
        }
    }

    /// Connected points `[x, y]`.
    #[must_use]
    pub fn line(points: Vec<[f64; 2]>) -> Self {
        Self::new(Mark::Line(points))
    }

    /// Points `[x, y]` whose value holds until the next.
    #[must_use]
    pub fn steps(points: Vec<[f64; 2]>) -> Self {
        Self::new(Mark::Steps(points))
    }

    /// An uncertainty band of `[x, low, high]`.
    #[must_use]
    pub fn band(points: Vec<[f64; 3]>) -> Self {
        Self::new(Mark::Band(points)).opacity(0.2)
    }

    /// The area between zero and `[x, y]`.
    #[must_use]
    pub fn area(points: Vec<[f64; 2]>) -> Self {
        Self::new(Mark::Area(points)).opacity(0.2)
    }

    /// Points `[x, y]`.
    #[must_use]
    pub fn dots(points: Vec<[f64; 2]>) -> Self {
        Self::new(Mark::Dots(points, 2.4))
    }

    /// Vertical strokes `[x, low, high]`, such as the noise of a reading.
    #[must_use]
    pub fn whiskers(points: Vec<[f64; 3]>) -> Self {
        Self::new(Mark::Whiskers(points)).opacity(0.45)
    }

    /// Bars `[x0, x1, y]` that start at zero.
    #[must_use]
    pub fn bars(bars: Vec<[f64; 3]>) -> Self {
        Self::new(Mark::Bars(bars)).opacity(0.8)
    }

    /// A vertical line at `x`; its label stands above the plot.
    #[must_use]
    pub fn vertical(x: f64) -> Self {
        Self::new(Mark::Vertical(x))
    }

    /// A horizontal line at `y`.
    #[must_use]
    pub fn horizontal(y: f64) -> Self {
        Self::new(Mark::Horizontal(y))
    }

    /// A shaded range of the x axis, with its name above the plot.
    #[must_use]
    pub fn span(x0: f64, x1: f64, name: &str) -> Self {
        Self::new(Mark::Span(x0, x1, name.to_owned()))
            .colour(Colour::Muted)
            .opacity(0.12)
    }

    /// Sets the colour.
    #[must_use]
    pub fn colour(mut self, colour: Colour) -> Self {
        self.colour = colour;
        self
    }

    /// Sets the text of the legend, or of the marker line.
    #[must_use]
    pub fn label(mut self, label: impl Into<String>) -> Self {
        self.label = Some(label.into());
        self
    }

    /// Draws lines in long dashes.
    #[must_use]
    pub fn dashed(mut self) -> Self {
        self.dash = Dash::Dashed;
        self
    }

    /// Draws lines dotted.
    #[must_use]
    pub fn dotted(mut self) -> Self {
        self.dash = Dash::Dotted;
        self
    }

    /// Sets the opacity, 0 to 1.
    #[must_use]
    pub fn opacity(mut self, opacity: f64) -> Self {
        self.opacity = opacity.clamp(0.0, 1.0);
        self
    }

    /// Sets the width of lines in SVG units; other marks ignore it.
    #[must_use]
    pub fn width(mut self, width: f64) -> Self {
        self.width = Some(width);
        self
    }

    /// The attribute for a line width that differs from the default.
    pub(crate) fn width_style(&self) -> String {
        self.width.map_or_else(String::new, |width| {
            format!(
                " style=\"stroke-width:{};stroke-linecap:round\"",
                super::coordinate(width)
            )
        })
    }

    /// Sets the radius of dots in SVG units; other marks ignore it.
    #[must_use]
    pub fn radius(mut self, radius: f64) -> Self {
        if let Mark::Dots(_, r) = &mut self.mark {
            *r = radius;
        }
        self
    }

    /// Extent `[[x_low, x_high], [y_low, y_high]]` of the finite data; infinite and inverted if
    /// there are none.
    pub(crate) fn extent(&self) -> [[f64; 2]; 2] {
        let mut extent = Extent::default();
        match &self.mark {
            Mark::Line(points) | Mark::Steps(points) | Mark::Dots(points, _) => {
                points.iter().for_each(|p| extent.include(p[0], p[1]));
            }
            Mark::Band(points) | Mark::Whiskers(points) => points.iter().for_each(|p| {
                extent.include(p[0], p[1]);
                extent.include(p[0], p[2]);
            }),
            Mark::Area(points) => points.iter().for_each(|p| {
                extent.include(p[0], p[1]);
                extent.include(p[0], 0.0);
            }),
            Mark::Bars(bars) => bars.iter().for_each(|b| {
                extent.include(b[0], b[2]);
                extent.include(b[1], 0.0);
            }),
            Mark::Vertical(x) => extent.include_x(*x),
            Mark::Horizontal(y) => extent.include_y(*y),
            Mark::Span(x0, x1, _) => [*x0, *x1].into_iter().for_each(|x| extent.include_x(x)),
        }
        [extent.x, extent.y]
    }
}

/// A box that grows to hold finite points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    pub(crate) x: [f64; 2],
    pub(crate) y: [f64; 2],
}

impl Default for Extent {
    fn default() -> Self {
        let nothing = [f64::INFINITY, f64::NEG_INFINITY];
        Self {
            x: nothing,
            y: nothing,
        }
    }
}

impl Extent {
    pub(crate) fn include(&mut self, x: f64, y: f64) {
        if x.is_finite() && y.is_finite() {
            self.include_x(x);
            self.include_y(y);
        }
    }

    pub(crate) fn include_x(&mut self, x: f64) {
        if x.is_finite() {
            self.x = [self.x[0].min(x), self.x[1].max(x)];
        }
    }

    pub(crate) fn include_y(&mut self, y: f64) {
        if y.is_finite() {
            self.y = [self.y[0].min(y), self.y[1].max(y)];
        }
    }
}
