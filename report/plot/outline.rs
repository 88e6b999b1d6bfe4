//! Shapes of a plan view and how they are drawn.

use super::frame::Frame;
use super::layer::Extent;
use super::marks::path;
use super::{Colour, Dash, coordinate};

/// A shape in the plane, in data units.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    pub(super) points: Vec<[f64; 2]>,
    pub(super) circle: Option<f64>,
    pub(super) closed: bool,
    pub(super) dots: bool,
    /// Whether dots grow from faint to strong.
    pub(super) fade: bool,
    pub(super) colour: Colour,
    pub(super) dash: Dash,
    pub(super) fill: f64,
    pub(super) stroke: f64,
    pub(super) context: bool,
    pub(super) label: Option<(String, bool)>,
}

impl Outline {
    fn new(points: Vec<[f64; 2]>) -> Self {
        Self {
            points,
            circle: None,
            closed: true,
            dots: false,
            fade: false,
            colour: Colour::Ink,
            dash: Dash::Solid,
            fill: 0.1,
            stroke: 1.0,
            context: false,
            label: None,
        }
    }

    /// A closed polygon.
    #[must_use]
    pub fn polygon(points: Vec<[f64; 2]>) -> Self {
        Self::new(points)
    }

    /// A circle.
    #[must_use]
    pub fn circle(center: [f64; 2], radius: f64) -> Self {
        Self {
            circle: Some(radius.abs()),
            ..Self::new(vec![center])
        }
    }

    /// An open path.
    #[must_use]
    pub fn path(points: Vec<[f64; 2]>) -> Self {
        Self {
            closed: false,
            fill: 0.0,
            ..Self::new(points)
        }
    }

    /// Dots that grow from faint to strong along the sequence: time.
    #[must_use]
    pub fn trail(points: Vec<[f64; 2]>) -> Self {
        Self {
            closed: false,
            dots: true,
            fade: true,
            ..Self::new(points)
        }
    }

    /// Dots of equal size.
    #[must_use]
    pub fn spots(points: Vec<[f64; 2]>) -> Self {
        Self {
            closed: false,
            dots: true,
            ..Self::new(points)
        }
    }

    /// Sets the colour.
    #[must_use]
    pub fn colour(mut self, colour: Colour) -> Self {
        self.colour = colour;
        self
    }

    /// Sets the opacities of fill and outline, 0 to 1.
    #[must_use]
    pub fn strength(mut self, fill: f64, stroke: f64) -> Self {
        (self.fill, self.stroke) = (fill.clamp(0.0, 1.0), stroke.clamp(0.0, 1.0));
        self
    }

    /// Draws the outline in dashes.
    #[must_use]
    pub fn dashed(mut self) -> Self {
        self.dash = Dash::Dashed;
        self
    }

    /// Sets the text of the legend.
    #[must_use]
    pub fn label(mut self, label: impl Into<String>) -> Self {
        self.label = Some((label.into(), false));
        self
    }

    /// Labels a whole series of ghosts in the legend, from faint to strong.
    #[must_use]
    pub fn series_label(mut self, label: impl Into<String>) -> Self {
        self.label = Some((label.into(), true));
        self
    }

    /// Draws the shape where it is in view, without widening the view for it.
    #[must_use]
    pub fn context(mut self) -> Self {
        self.context = true;
        self
    }

    /// Whether any of the shape's line lies in `view`.
    pub(super) fn is_in(&self, view: &Extent) -> bool {
        let inside = |x: f64, y: f64| {
            (view.x[0]..=view.x[1]).contains(&x) && (view.y[0]..=view.y[1]).contains(&y)
        };
        let samples = || (0..=64).map(|i| f64::from(i) / 64.0);
        if let (Some(r), Some([x, y])) = (self.circle, self.points.first()) {
            return samples().any(|share| {
                let (sin, cos) = (std::f64::consts::TAU * share).sin_cos();
                inside(x + r * cos, y + r * sin)
            });
        }
        let next = self.points.iter().cycle().skip(1);
        self.points.iter().zip(next).any(|(a, b)| {
            samples().any(|s| inside(a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])))
        })
    }

    /// Grows `extent` to hold the shape.
    pub(super) fn extend(&self, extent: &mut Extent) {
        let r = self.circle.unwrap_or(0.0);
        for [x, y] in &self.points {
            extent.include(x - r, y - r);
            extent.include(x + r, y + r);
        }
    }
}

/// The shape inside the frame's box, as SVG.
pub(super) fn draw(outline: &Outline, frame: &Frame) -> String {
    let class = outline.colour.class();
    let at = |p: &[f64; 2]| [frame.x.map(p[0]), frame.y.map(p[1])];
    let style = format!(
        "class=\"shape {class}\" fill-opacity=\"{}\" stroke-opacity=\"{}\"{}",
        coordinate(outline.fill),
        coordinate(outline.stroke),
        outline.dash.attribute()
    );
    let points: Vec<[f64; 2]> = outline.points.iter().map(at).collect();
    if let Some(radius) = outline.circle {
        let Some([cx, cy]) = points
            .first()
            .filter(|p| p.iter().all(|c| c.is_finite()) && radius.is_finite())
        else {
            return String::new();
        };
        let r = (frame.x.map(outline.points[0][0] + radius) - cx).abs();
        return format!(
            "<circle {style} cx=\"{}\" cy=\"{}\" r=\"{}\"/>",
            coordinate(*cx),
            coordinate(*cy),
            coordinate(r)
        );
    }
    if outline.dots {
        let last = points.len().saturating_sub(1).max(1) as f64;
        return points
            .iter()
            .enumerate()
            .filter(|(_, p)| p.iter().all(|c| c.is_finite()))
            .map(|(i, [cx, cy])| {
                format!(
                    "<circle class=\"fill {class}\" fill-opacity=\"{}\" cx=\"{}\" cy=\"{}\" r=\"3\"/>",
                    coordinate(if outline.fade {
                        0.35 + 0.65 * i as f64 / last
                    } else {
                        0.85
                    }),
                    coordinate(*cx),
                    coordinate(*cy)
                )
            })
            .collect();
    }
    let d = path(&points);
    if d.is_empty() {
        return String::new();
    }
    let close = if outline.closed { "Z" } else { "" };
    format!("<path {style} d=\"{d}{close}\"/>")
}
