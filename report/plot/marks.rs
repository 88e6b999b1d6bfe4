//! Layers of a chart as SVG elements, without non-finite points.

use super::coordinate;
use super::frame::Frame;
use super::layer::{Layer, Mark};
use crate::markup::escape;

/// Number of points to which a line is thinned; a plot has fewer pixels than this.
const MOST_POINTS: usize = 900;

/// The layer inside the frame's box, as SVG.
pub(super) fn draw(layer: &Layer, frame: &Frame) -> String {
    let class = layer.colour.class();
    let (x, y) = (&frame.x, &frame.y);
    let [left, top, right, bottom] = frame.area;
    let zero = y.map_clamped(0.0);
    let opacity = coordinate(layer.opacity);
    let at = |p: &[f64; 2]| [x.map(p[0]), y.map(p[1])];
    // The legend's name, for the tooltip.
    let name = (layer.label.as_deref()).map_or_else(String::new, |label| {
        format!(" data-name=\"{}\"", escape(label))
    });
    let stroke = |path: &str| {
        if path.is_empty() {
            return String::new();
        }
        format!(
            "<path class=\"line {class}\" d=\"{path}\"{name} stroke-opacity=\"{opacity}\"{}{}/>",
            layer.dash.attribute(),
            layer.width_style()
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
            let dots = dots(points.iter().map(at), *radius);
            format!("<g class=\"fill {class}\"{name} fill-opacity=\"{opacity}\">{dots}</g>")
        }
        Mark::Whiskers(points) => {
            let places = points.iter();
            stroke(&whiskers(
                places.map(|p| [x.map(p[0]), y.map(p[1]), y.map(p[2])]),
            ))
        }
        Mark::Bars(bars) => {
            let places = bars.iter();
            let rectangles = rectangles(
                places.map(|b| [x.map(b[0]), x.map(b[1]), y.map(b[2])]),
                zero,
            );
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
            // A thin gap between neighbours shows where one ends.
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

fn is_finite(place: &[f64; 3]) -> bool {
    place.iter().all(|c| c.is_finite())
}

/// Circles at some positions.
fn dots(places: impl Iterator<Item = [f64; 2]>, radius: f64) -> String {
    let seen = places.filter(|p| p.iter().all(|c| c.is_finite()));
    seen.map(|[cx, cy]| {
        format!(
            "<circle cx=\"{}\" cy=\"{}\" r=\"{}\"/>",
            coordinate(cx),
            coordinate(cy),
            coordinate(radius)
        )
    })
    .collect()
}

/// A path of vertical strokes: at `x`, from one `y` to another.
fn whiskers(places: impl Iterator<Item = [f64; 3]>) -> String {
    let stroke = |p: [f64; 3]| {
        let [x, from, to] = p.map(coordinate);
        format!("M{x} {from}V{to}")
    };
    places.filter(is_finite).map(stroke).collect()
}

/// A path of rectangles based on `zero`: from one `x` to another, up to `y`.
fn rectangles(places: impl Iterator<Item = [f64; 3]>, zero: f64) -> String {
    let rectangle = |[x0, x1, y1]: [f64; 3]| {
        let gap = if (x1 - x0).abs() > 4.0 { 0.6 } else { 0.0 };
        format!(
            "M{} {}V{}H{}V{}Z",
            coordinate(x0 + gap),
            coordinate(zero),
            coordinate(y1),
            coordinate(x1 - gap),
            coordinate(zero)
        )
    };
    places.filter(is_finite).map(rectangle).collect()
}

/// An SVG path through `points`, interrupted at non-finite ones.
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

/// Closed shapes between `[x, y0]` and `[x, y1]`, one for each stretch of finite points.
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

/// Keeps first, lowest, highest and last of each stretch of a long line, which looks the same at
/// this size.
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
