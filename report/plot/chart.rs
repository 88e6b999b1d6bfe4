//! A chart: layers of data over two axes.

use super::frame::{Axis, Frame, Request};
use super::header::{Above, Entry, Key};
use super::layer::{Extent, Layer, Mark};
use super::scale::Spacing;
use super::{Dash, NARROW, Plot, coordinate, root};
use crate::markup::escape;

/// Points a line is thinned to; a plot has fewer pixels than this.
const MOST_POINTS: usize = 900;

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
}

impl Chart {
    /// An empty chart whose title says what one sees.
    #[must_use]
    pub fn new(title: &str, x: Axis, y: Axis) -> Self {
        Self {
            title: title.to_owned(),
            description: String::new(),
            x,
            y,
            height: 190.0,
            layers: Vec::new(),
        }
    }

    /// Adds a layer over those there are.
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

    /// Sets the description read to those who cannot see the chart.
    #[must_use]
    pub fn description(mut self, description: impl Into<String>) -> Self {
        self.description = description.into();
        self
    }

    /// Sets the height of the box that the data are drawn in, in SVG units.
    #[must_use]
    pub fn height(mut self, height: f64) -> Self {
        self.height = height.max(40.0);
        self
    }

    /// The domains of both axes: as fixed, or those of the data with a little room.
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

    /// The labels above the plot. A span whose name would be wider than itself still gets one: lanes keep them apart.
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
        root(
            id,
            [frame.width, frame.height],
            &self.title,
            &self.description,
            &body,
        )
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
    // Data that stand on zero keep standing on the axis.
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

fn draw(layer: &Layer, frame: &Frame) -> String {
    let class = layer.colour.class();
    let (x, y) = (&frame.x, &frame.y);
    let [left, top, right, bottom] = frame.area;
    let zero = y.map_clamped(0.0);
    let opacity = coordinate(layer.opacity);
    let at = |p: &[f64; 2]| [x.map(p[0]), y.map(p[1])];
    let stroke = |path: &str| {
        if path.is_empty() {
            return String::new();
        }
        format!(
            "<path class=\"line {class}\" d=\"{path}\" stroke-opacity=\"{opacity}\"{}/>",
            layer.dash.attribute()
        )
    };
    let fill = |path: &str| {
        format!("<path class=\"fill {class}\" d=\"{path}\" fill-opacity=\"{opacity}\"/>")
    };
    match &layer.mark {
        Mark::Line(points) => stroke(&path(&thin(points.iter().map(at).collect()))),
        Mark::Steps(points) => {
            let mut corners: Vec<[f64; 2]> = Vec::with_capacity(2 * points.len());
            for p in points.iter().map(at) {
                if let Some(&[_, before]) = corners.last() {
                    corners.push([p[0], before]);
                }
                corners.push(p);
            }
            stroke(&path(&corners))
        }
        Mark::Band(points) => {
            let edges = points
                .iter()
                .map(|p| [x.map(p[0]), y.map(p[1]), y.map(p[2])]);
            fill(&ribbon(&edges.collect::<Vec<_>>()))
        }
        Mark::Area(points) => {
            let edges = points.iter().map(|p| [x.map(p[0]), zero, y.map(p[1])]);
            fill(&ribbon(&edges.collect::<Vec<_>>()))
        }
        Mark::Dots(points, radius) => {
            let dots: String = points
                .iter()
                .map(at)
                .filter(|p| p.iter().all(|c| c.is_finite()))
                .map(|[cx, cy]| {
                    format!(
                        "<circle cx=\"{}\" cy=\"{}\" r=\"{}\"/>",
                        coordinate(cx),
                        coordinate(cy),
                        coordinate(*radius)
                    )
                })
                .collect();
            format!("<g class=\"fill {class}\" fill-opacity=\"{opacity}\">{dots}</g>")
        }
        Mark::Whiskers(points) => {
            let strokes: String = points
                .iter()
                .map(|p| [x.map(p[0]), y.map(p[1]), y.map(p[2])])
                .filter(|p| p.iter().all(|c| c.is_finite()))
                .map(|p| {
                    format!(
                        "M{} {}V{}",
                        coordinate(p[0]),
                        coordinate(p[1]),
                        coordinate(p[2])
                    )
                })
                .collect();
            stroke(&strokes)
        }
        Mark::Bars(bars) => {
            let rectangles: String = bars
                .iter()
                .map(|b| [x.map(b[0]), x.map(b[1]), y.map(b[2])])
                .filter(|b| b.iter().all(|c| c.is_finite()))
                .map(|[x0, x1, y1]| {
                    let gap = if (x1 - x0).abs() > 4.0 { 0.6 } else { 0.0 };
                    format!(
                        "M{} {}V{}H{}V{}Z",
                        coordinate(x0 + gap),
                        coordinate(zero),
                        coordinate(y1),
                        coordinate(x1 - gap),
                        coordinate(zero)
                    )
                })
                .collect();
            fill(&rectangles)
        }
        Mark::Vertical(value) if x.map(*value).is_finite() => stroke(&format!(
            "M{} {}V{}",
            coordinate(x.map(*value)),
            coordinate(top),
            coordinate(bottom)
        )),
        Mark::Horizontal(value) if y.map(*value).is_finite() => stroke(&format!(
            "M{} {}H{}",
            coordinate(left),
            coordinate(y.map(*value)),
            coordinate(right)
        )),
        Mark::Span(x0, x1, _) if x0.is_finite() && x1.is_finite() => {
            let (a, b) = (x.map_clamped(x0.min(*x1)), x.map_clamped(x0.max(*x1)));
            // A hair's breadth between neighbours shows where one ends.
            fill(&format!(
                "M{} {}V{}H{}V{}Z",
                coordinate(a + 0.5),
                coordinate(bottom),
                coordinate(top),
                coordinate(b - 0.5),
                coordinate(bottom)
            ))
        }
        Mark::Vertical(_) | Mark::Horizontal(_) | Mark::Span(..) => String::new(),
    }
}

/// An SVG path through `points`, interrupted where one is not finite.
pub(super) fn path(points: &[[f64; 2]]) -> String {
    let mut d = String::new();
    let mut pen_down = false;
    for [x, y] in points {
        if x.is_finite() && y.is_finite() {
            d.push_str(&format!(
                "{}{} {}",
                if pen_down { 'L' } else { 'M' },
                coordinate(*x),
                coordinate(*y)
            ));
            pen_down = true;
        } else {
            pen_down = false;
        }
    }
    d
}

/// Closed shapes between `[x, y0]` and `[x, y1]`, one a stretch of finite points.
fn ribbon(edges: &[[f64; 3]]) -> String {
    edges
        .split(|e| e.iter().any(|c| !c.is_finite()))
        .filter(|stretch| stretch.len() > 1)
        .map(|stretch| {
            let there = stretch.iter().map(|e| [e[0], e[2]]);
            let back = stretch.iter().rev().map(|e| [e[0], e[1]]);
            format!("{}Z", path(&there.chain(back).collect::<Vec<_>>()))
        })
        .collect()
}

/// Keeps first, lowest, highest and last of each stretch of a long line, which draws the same at this size.
fn thin(points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    if points.len() <= MOST_POINTS {
        return points;
    }
    let stretch = points.len().div_ceil(MOST_POINTS / 4);
    let mut kept = Vec::with_capacity(MOST_POINTS);
    for part in points.chunks(stretch) {
        let by = |better: fn(f64, f64) -> bool| {
            (1..part.len()).fold(0, |best, i| {
                if better(part[i][1], part[best][1]) {
                    i
                } else {
                    best
                }
            })
        };
        let mut indices = [0, by(|a, b| a < b), by(|a, b| a > b), part.len() - 1];
        indices.sort_unstable();
        let mut last = usize::MAX;
        for i in indices {
            if i != last {
                kept.push(part[i]);
                last = i;
            }
        }
    }
    kept
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
        // Coordinates are rounded to a hundredth, those of the box as well.
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

    #[test]
    fn thinning_keeps_the_extremes() {
        let mut points: Vec<[f64; 2]> = (0..10_000).map(|i| [f64::from(i), 0.0]).collect();
        points[5_003][1] = 7.0;
        points[7_001][1] = -3.0;
        let kept = thin(points);
        assert!(
            kept.len() <= MOST_POINTS + 4
                && kept.contains(&[5_003.0, 7.0])
                && kept.contains(&[7_001.0, -3.0])
        );
    }
}
