//! A chart: layers of data over two axes.

use super::clock::Clock;
use super::frame::{Axis, Frame, Request};
use super::header::{Above, Entry, Key};
use super::layer::{Extent, Layer, Mark};
use super::marks::draw;
use super::scale::Spacing;
use super::{Dash, NARROW, Plot, coordinate, root};
use crate::markup::escape;

/// A chart of [`Layer`]s.
///
/// ```
/// use asid_report::plot::{Axis, Chart, Colour, Layer, NARROW, Plot};
/// let chart = Chart::new("Tilt after release", Axis::new("time", "s"), Axis::new("tilt", "deg").zero())
///     .layer(Layer::line(vec![[0.0, 0.0], [0.1, 0.4]]).colour(Colour::Blue).label("rod"));
/// assert!(chart.svg("tilt", NARROW).starts_with("<svg"));
/// ```
#[derive(Clone, Debug)]
pub struct Chart {
    title: String,
    description: String,
    x: Axis,
    y: Axis,
    height: f64,
    layers: Vec<Layer>,
    clock: Option<Clock>,
}

impl Chart {
    /// An empty chart whose title says what it shows.
    #[must_use]
    pub fn new(title: &str, x: Axis, y: Axis) -> Self {
        Self {
            title: title.to_owned(),
            description: String::new(),
            x,
            y,
            height: 190.0,
            layers: Vec::new(),
            clock: None,
        }
    }

    /// Adds a layer on top of the existing ones.
    #[must_use]
    pub fn layer(mut self, layer: Layer) -> Self {
        self.layers.push(layer);
        self
    }

    /// Adds layers in order.
    #[must_use]
    pub fn layers(mut self, layers: impl IntoIterator<Item = Layer>) -> Self {
        self.layers.extend(layers);
        self
    }

    /// Sets the description for screen readers.
    #[must_use]
    pub fn description(mut self, description: impl Into<String>) -> Self {
        self.description = description.into();
        self
    }

    /// Links it to the 3-D view of an episode: a line shows the current time, and a click moves to
    /// a time.
    ///
    /// `take` is the episode, empty for the one being played; its first row is at `start` on the
    /// chart's axis, s.
    #[must_use]
    pub fn clock(mut self, take: &str, start: f64) -> Self {
        self.clock = Some(Clock {
            take: take.to_owned(),
            start,
        });
        self
    }

    /// Sets the height of the data box, in SVG units.
    #[must_use]
    pub fn height(mut self, height: f64) -> Self {
        self.height = height.max(40.0);
        self
    }

    /// The domains of both axes: as fixed, or those of the data plus a margin.
    fn domains(&self) -> Option<[[f64; 2]; 2]> {
        let mut extent = Extent::default();
        for layer in &self.layers {
            let [x, y] = layer.extent();
            x.into_iter().for_each(|x| extent.include_x(x));
            y.into_iter().for_each(|y| extent.include_y(y));
        }
        let has_data = self.layers.iter().any(|l| {
            !matches!(
                l.mark,
                Mark::Vertical(_) | Mark::Horizontal(_) | Mark::Span(..)
            ) && l.extent()[0][0].is_finite()
        });
        let points = self
            .layers
            .iter()
            .any(|l| matches!(l.mark, Mark::Dots(..) | Mark::Whiskers(_)));
        let x = domain(&self.x, extent.x, if points { 0.02 } else { 0.0 });
        let y = domain(&self.y, extent.y, 0.06);
        has_data.then_some([x, y])
    }

    fn entries(&self) -> Vec<Entry> {
        let mut entries: Vec<Entry> = Vec::new();
        for layer in &self.layers {
            let key = match layer.mark {
                Mark::Line(_) if layer.width.is_some() => {
                    Key::Broad(layer.width.unwrap_or_default(), layer.opacity)
                }
                Mark::Vertical(_) | Mark::Span(..) => continue,
                Mark::Line(_) | Mark::Steps(_) | Mark::Horizontal(_) => Key::Line(layer.dash),
                Mark::Whiskers(_) => Key::Line(Dash::Solid),
                Mark::Band(_) | Mark::Area(_) | Mark::Bars(_) => Key::Fill(layer.opacity),
                Mark::Dots(..) => Key::Dot(layer.opacity),
            };
            if let Some(text) = layer.label.as_ref().filter(|t| !t.is_empty()) {
                entries.push(Entry {
                    key,
                    colour: layer.colour,
                    text: text.clone(),
                });
            }
        }
        entries
    }

    /// The labels above the plot. A span narrower than its name still gets one, because lanes keep
    /// labels apart.
    fn above(&self, [x_low, x_high]: [f64; 2]) -> Vec<Above> {
        self.layers
            .iter()
            .filter_map(|layer| match &layer.mark {
                Mark::Vertical(x) => layer.label.as_ref().map(|text| Above {
                    x: *x,
                    text: text.clone(),
                    colour: layer.colour,
                }),
                Mark::Span(x0, x1, name) if x0.is_finite() && x1.is_finite() => {
                    let middle = 0.5 * (x0.max(x_low) + x1.min(x_high));
                    Some(Above {
                        x: middle,
                        text: name.clone(),
                        colour: layer.colour,
                    })
                }
                _ => None,
            })
            .filter(|a| a.x.is_finite())
            .collect()
    }
}

impl Plot for Chart {
    fn svg(&self, id: &str, width: f64) -> String {
        let domains = self.domains();
        let [x, y] = domains.unwrap_or([[0.0, 1.0], [0.0, 1.0]]);
        let above = if domains.is_some() {
            self.above(x)
        } else {
            Vec::new()
        };
        let entries = if domains.is_some() {
            self.entries()
        } else {
            Vec::new()
        };
        let request = Request {
            id,
            width,
            x: (&self.x, x),
            y: (&self.y, y),
            entries,
            above,
            map_grid: false,
        };
        let height = if width > NARROW * 1.5 {
            self.height * 1.15
        } else {
            self.height
        };
        let frame = Frame::new(request, height);

        let mut body = frame.clip.clone();
        let [left, top, right, bottom] = frame.area;
        if domains.is_none() {
            body.push_str(&frame.svg);
            body.push_str(&format!(
                "<text class=\"empty\" text-anchor=\"middle\" x=\"{}\" y=\"{}\">no data</text>",
                coordinate(0.5 * (left + right)),
                coordinate(0.5 * (top + bottom))
            ));
        } else {
            let clipped =
                |inner: &str| format!("<g clip-path=\"url(#{}-clip)\">{inner}</g>", escape(id));
            let (spans, marks): (Vec<_>, Vec<_>) = self
                .layers
                .iter()
                .partition(|l| matches!(l.mark, Mark::Span(..)));
            body.push_str(&clipped(
                &spans.iter().map(|l| draw(l, &frame)).collect::<String>(),
            ));
            body.push_str(&frame.svg);
            body.push_str(&clipped(
                &marks.iter().map(|l| draw(l, &frame)).collect::<String>(),
            ));
        }
        let clock = (self.clock.as_ref()).filter(|_| domains.is_some());
        let clock = clock.map(|c| {
            let label = self.y.text(0);
            c.attributes(frame.x.domain(), (&label, frame.y.domain()), frame.area)
        });
        let svg = root(
            id,
            [frame.width, frame.height],
            &self.title,
            &self.description,
            &body,
        );
        match clock {
            Some(attributes) => svg.replacen("<svg", &format!("<svg{attributes}"), 1),
            None => svg,
        }
    }
}

fn domain(axis: &Axis, data: [f64; 2], pad: f64) -> [f64; 2] {
    if let Some(fixed) = axis.domain {
        return fixed;
    }
    let [mut low, mut high] = data;
    if !low.is_finite() || !high.is_finite() {
        return [0.0, 1.0];
    }
    if axis.zero {
        [low, high] = [low.min(0.0), high.max(0.0)];
    }
    if axis.spacing == Spacing::Log && low > 0.0 {
        let ratio = (high / low).powf(pad);
        return [low / ratio, high * ratio];
    }
    let room = pad * (high - low);
    // Data that stand on zero remain on the axis.
    [
        if axis.zero && low == 0.0 {
            0.0
        } else {
            low - room
        },
        if axis.zero && high == 0.0 {
            0.0
        } else {
            high + room
        },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{NARROW, Scale};

    fn chart() -> Chart {
        Chart::new(
            "t <&>",
            Axis::new("x & y", "m"),
            Axis::new("y", "").domain([0.0, 2.0]),
        )
    }

    #[test]
    fn a_marker_line_stands_where_the_scale_says() {
        let svg = chart()
            .layer(Layer::line(vec![[0.0, 0.0], [0.1, 2.0]]))
            .layer(Layer::vertical(0.06).label("truth"))
            .svg("a", NARROW);
        let document = roxmltree::Document::parse(&svg).unwrap();
        let clip = document
            .descendants()
            .find(|n| n.has_tag_name("rect"))
            .unwrap();
        let number = |name: &str| clip.attribute(name).unwrap().parse::<f64>().unwrap();
        let scale = Scale::new(
            [0.0, 0.1],
            [number("x"), number("x") + number("width")],
            Spacing::Linear,
        );
        let d = document
            .descendants()
            .find_map(|n| n.attribute("d").filter(|d| d.contains('V')))
            .unwrap();
        let drawn: f64 = d[1..].split(' ').next().unwrap().parse().unwrap();
        // Coordinates are rounded to a hundredth, and so are those of the box.
        assert!(
            (drawn - scale.map(0.06)).abs() < 0.02,
            "{drawn} is not {}",
            scale.map(0.06)
        );
    }

    #[test]
    fn what_is_not_finite_is_skipped() {
        let nan = f64::NAN;
        let svg = chart()
            .layer(
                Layer::line(vec![
                    [0.0, 1.0],
                    [1.0, nan],
                    [f64::INFINITY, 1.0],
                    [3.0, 1.0],
                    [4.0, 1.5],
                ])
                .label("a"),
            )
            .layer(Layer::band(vec![
                [0.0, 0.0, nan],
                [1.0, 0.0, 1.0],
                [2.0, 0.5, 1.0],
            ]))
            .layer(Layer::dots(vec![[nan, nan], [1.0, 1.0]]))
            .layer(Layer::bars(vec![[0.0, 1.0, nan], [1.0, 2.0, 1.0]]))
            .layer(Layer::whiskers(vec![[0.0, nan, 1.0]]))
            .layer(Layer::vertical(nan).label("nowhere"))
            .layer(Layer::span(nan, 1.0, "no span"))
            .layer(Layer::horizontal(f64::NEG_INFINITY))
            .svg("a", NARROW);
        assert!(roxmltree::Document::parse(&svg).is_ok());
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        assert!(
            !svg.contains("no span") && !svg.contains("nowhere"),
            "{svg}"
        );
        assert_eq!(svg.matches("<circle").count(), 1, "{svg}");
    }

    #[test]
    fn no_data_says_so() {
        for layers in [
            vec![],
            vec![Layer::line(vec![])],
            vec![Layer::dots(vec![[f64::NAN, 0.0]]), Layer::vertical(1.0)],
        ] {
            let svg = chart().layers(layers).svg("a", NARROW);
            assert!(roxmltree::Document::parse(&svg).is_ok() && svg.contains("no data"));
        }
    }
}
