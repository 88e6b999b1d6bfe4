//! A square table of shaded cells: pairwise similarity.

use super::header::layout;
use super::{Colour, FONT_SIZE, Plot, coordinate, root};
use crate::markup::{escape, fit, text_width};

/// Largest side of a cell, SVG units, so that a table of two stays small.
const LARGEST: f64 = 44.0;
/// Smallest side of a cell, SVG units: rows of text beside it still do not overlap.
const SMALLEST: f64 = 17.0;
/// Largest share of the width that names take.
const NAMES: f64 = 0.42;
/// Opacity of a cell above which its text has the paper's colour.
const DARK: f64 = 0.55;

/// A table with a row and a column for each name. Rows carry number and name, columns only the
/// number.
#[derive(Clone, Debug)]
pub struct Heat {
    title: String,
    description: String,
    names: Vec<String>,
    shades: Vec<Vec<f64>>,
    texts: Vec<Vec<String>>,
}

impl Heat {
    /// Cells with `shades` (0 to 1, one row a name; non-finite ones stay empty), and with `texts`
    /// in them if all fit.
    #[must_use]
    pub fn new(
        title: &str,
        names: Vec<String>,
        shades: Vec<Vec<f64>>,
        texts: Vec<Vec<String>>,
    ) -> Self {
        Self {
            title: title.to_owned(),
            description: String::new(),
            names,
            shades,
            texts,
        }
    }

    /// Sets the description for screen readers.
    #[must_use]
    pub fn description(mut self, description: impl Into<String>) -> Self {
        self.description = description.into();
        self
    }

    /// Shade and text of a cell.
    fn cell(&self, i: usize, j: usize) -> Option<(f64, &str)> {
        let shade = self.shades.get(i)?.get(j).filter(|s| s.is_finite())?;
        let text = self.texts.get(i).and_then(|row| row.get(j));
        Some((shade.clamp(0.0, 1.0), text.map_or("", String::as_str)))
    }
}

/// A text element.
fn text(class: &str, anchor: &str, [x, y]: [f64; 2], content: &str) -> String {
    format!(
        "<text class=\"{class}\" text-anchor=\"{anchor}\" x=\"{}\" y=\"{}\">{}</text>",
        coordinate(x),
        coordinate(y),
        escape(content)
    )
}

impl Plot for Heat {
    fn svg(&self, id: &str, width: f64) -> String {
        let n = self.names.len();
        let numbered: Vec<String> = (self.names.iter().enumerate())
            .map(|(i, name)| format!("{}. {name}", i + 1))
            .collect();
        let longest = numbered
            .iter()
            .map(|t| text_width(t, FONT_SIZE))
            .fold(40.0, f64::max);
        let room = longest.min(NAMES * width);
        let left = room + 12.0;
        let side = ((width - left - 2.0) / n.max(1) as f64).clamp(1.0, LARGEST);
        // On a narrow page cells are lower than rows of text, so they become taller than wide.
        let height = side.max(SMALLEST);
        let header = layout(width, "", &[], &[]);
        let top = header.height + 20.0;
        let mut svg = header.svg;
        let middle = |y: f64| y + 0.5 * height + 0.35 * FONT_SIZE;
        let numbers_fit = side > text_width("00", FONT_SIZE) + 3.0;
        let texts = || self.texts.iter().flatten();
        let texts_fit = texts().all(|t| text_width(t, FONT_SIZE) + 3.0 < side);
        for (i, name) in numbered.iter().enumerate() {
            let y = top + height * i as f64;
            let name_fits = fit(name, FONT_SIZE, room);
            svg.push_str(&text("tick", "end", [left - 8.0, middle(y)], &name_fits));
            let at = left + side * (i as f64 + 0.5);
            if numbers_fit || i % 2 == 0 {
                let number = (i + 1).to_string();
                svg.push_str(&text("tick", "middle", [at, top - 6.0], &number));
            }
            for j in 0..n {
                let Some((shade, told)) = self.cell(i, j) else {
                    continue;
                };
                let x = left + side * j as f64;
                let number = format!("{} and {}: {told}", self.names[i], self.names[j]);
                svg.push_str(&format!(
                    "<g><title>{}</title><rect class=\"fill {}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" \
                     fill-opacity=\"{}\"/></g>",
                    escape(&number),
                    Colour::Vermillion.class(),
                    coordinate(x + 0.5),
                    coordinate(y + 0.5),
                    coordinate((side - 1.0).max(0.5)),
                    coordinate(height - 1.0),
                    coordinate(0.04 + 0.96 * shade),
                ));
                if i != j && texts_fit {
                    let class = if shade > DARK { "on-fill" } else { "" };
                    let place = [x + 0.5 * side, middle(y)];
                    svg.push_str(&text(class, "middle", place, told));
                }
            }
        }
        let bottom = if n == 0 {
            let place = [0.5 * width, top + SMALLEST];
            svg.push_str(&text("empty", "middle", place, "no data"));
            top + 2.5 * SMALLEST
        } else {
            top + height * n as f64
        };
        let size = [width, bottom + 6.0];
        root(id, size, &self.title, &self.description, &svg)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{NARROW, WIDE};
    use super::*;

    fn of(n: usize) -> Heat {
        let cell = |i: usize, j: usize| 1.0 / (1.0 + i.abs_diff(j) as f64);
        let rows = |f: &dyn Fn(usize, usize) -> String| -> Vec<Vec<String>> {
            (0..n).map(|i| (0..n).map(|j| f(i, j)).collect()).collect()
        };
        Heat::new(
            "alike",
            (0..n).map(|i| format!("effect-{i}@<site>")).collect(),
            (0..n)
                .map(|i| (0..n).map(|j| cell(i, j)).collect())
                .collect(),
            rows(&|i, j| format!("{:.0}", cell(i, j).acos().to_degrees())),
        )
    }

    #[test]
    fn cells_are_as_dark_as_they_are_alike_and_lie_in_the_picture() {
        for width in [NARROW, WIDE] {
            let svg = of(3).svg("h", width);
            let document = roxmltree::Document::parse(&svg).unwrap();
            let rects = document.descendants().filter(|n| n.has_tag_name("rect"));
            let shades: Vec<f64> = rects
                .map(|n| n.attribute("fill-opacity").unwrap().parse().unwrap())
                .collect();
            assert_eq!(shades.len(), 9);
            assert!(shades[0] > shades[1] && shades[1] > shades[2], "{shades:?}");
            assert_eq!(shades[1], shades[3]);
        }
    }

    #[test]
    fn what_is_not_a_number_has_no_cell_and_nothing_says_so() {
        let mut heat = of(2);
        heat.shades[0][1] = f64::NAN;
        let svg = heat.svg("h", NARROW);
        assert_eq!(svg.matches("<rect").count(), 3);
        assert!(!svg.contains("NaN"));
        assert!(of(0).svg("h", NARROW).contains("no data"));
    }
}
