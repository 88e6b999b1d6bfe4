//! A plan view: shapes and paths in a plane, both axes to the same scale.

use super::frame::{Axis, Frame, Request};
use super::header::{Entry, Key};
use super::layer::Extent;
use super::outline::{Outline, draw};
use super::{Dash, NARROW, Plot, coordinate, root};
use crate::markup::escape;

/// A plan view of [`Outline`]s, drawn in the order given.
#[derive(Clone, Debug)]
pub struct Plan {
    title: String,
    description: String,
    x: Axis,
    y: Axis,
    outlines: Vec<Outline>,
    floor: Option<f64>,
}

impl Plan {
    /// An empty plan over axes of the same unit.
    #[must_use]
    pub fn new(title: &str, x: Axis, y: Axis) -> Self {
        Self {
            title: title.to_owned(),
            description: String::new(),
            x,
            y,
            outlines: Vec::new(),
            floor: None,
        }
    }

    /// Adds a shape on top of the existing ones.
    #[must_use]
    pub fn outline(mut self, outline: Outline) -> Self {
        self.outlines.push(outline);
        self
    }

    /// Sets the description for screen readers.
    #[must_use]
    pub fn description(mut self, description: impl Into<String>) -> Self {
        self.description = description.into();
        self
    }

    /// Prevents the view from extending below `y`: the floor of a side view.
    #[must_use]
    pub fn floor(mut self, y: f64) -> Self {
        self.floor = Some(y);
        self
    }

    /// The part of the plane to show; `None` where there is nothing.
    fn view(&self) -> Option<Extent> {
        let mut extent = Extent::default();
        self.outlines
            .iter()
            .filter(|o| !o.context)
            .for_each(|o| o.extend(&mut extent));
        if !extent.x[0].is_finite() {
            self.outlines.iter().for_each(|o| o.extend(&mut extent));
        }
        if !extent.x[0].is_finite() {
            return None;
        }
        let size = (extent.x[1] - extent.x[0]).max(extent.y[1] - extent.y[0]);
        let pad = if size > 0.0 { 0.07 * size } else { 0.1 };
        extent.x = [extent.x[0] - pad, extent.x[1] + pad];
        extent.y = [extent.y[0] - pad, extent.y[1] + pad];
        if let Some(floor) = self.floor.filter(|&f| f < extent.y[1]) {
            extent.y[0] = extent.y[0].max(floor);
        }
        Some(extent)
    }

    /// Legend of the visible shapes.
    fn entries(&self, view: &Extent) -> Vec<Entry> {
        let entry = |o: &Outline| {
            let (text, series) = o.label.clone()?;
            let key = match (series || o.dots, o.closed) {
                _ if o.dots && !o.fade => Key::Dot(0.85),
                (true, _) => Key::Fade,
                (false, true) if o.dash == Dash::Solid => Key::Fill(o.fill),
                _ => Key::Line(o.dash),
            };
            Some(Entry {
                key,
                colour: o.colour,
                text,
            })
        };
        self.outlines
            .iter()
            .filter(|o| o.is_in(view))
            .filter_map(entry)
            .collect()
    }
}

impl Plot for Plan {
    fn svg(&self, id: &str, width: f64) -> String {
        let view = self.view();
        let mut extent = view.unwrap_or(Extent {
            x: [0.0, 1.0],
            y: [0.0, 1.0],
        });

        // Equal scales determine the box's height. If it would be too flat or too tall, the shorter
        // side shows more of the plane.
        let limits = if width > NARROW * 1.5 {
            [0.28, 0.55]
        } else {
            [0.38, 0.95]
        };
        let mut plot_height = limits[1] * width;
        // The width of the tick labels depends on the height, and the height on that width: two
        // iterations suffice.
        for _ in 0..2 {
            let [left, right] = Frame::margins((&self.y, extent.y), plot_height);
            let across = width - left - right;
            let (w, h) = (extent.x[1] - extent.x[0], extent.y[1] - extent.y[0]);
            plot_height = (across * h / w).clamp(limits[0] * width, limits[1] * width);
            let unit = (w / across).max(h / plot_height);
            widen(&mut extent.x, unit * across, None);
            widen(&mut extent.y, unit * plot_height, self.floor);
        }

        let entries = if view.is_some() {
            self.entries(&extent)
        } else {
            Vec::new()
        };
        let request = Request {
            id,
            width,
            x: (&self.x, extent.x),
            y: (&self.y, extent.y),
            entries,
            above: Vec::new(),
            map_grid: true,
        };
        let frame = Frame::new(request, plot_height);
        let mut body = format!("{}{}", frame.clip, frame.svg);
        if view.is_some() {
            let shapes: String = self.outlines.iter().map(|o| draw(o, &frame)).collect();
            body.push_str(&format!(
                "<g clip-path=\"url(#{}-clip)\">{shapes}</g>",
                escape(id)
            ));
        } else {
            let [left, top, right, bottom] = frame.area;
            body.push_str(&format!(
                "<text class=\"empty\" text-anchor=\"middle\" x=\"{}\" y=\"{}\">no data</text>",
                coordinate(0.5 * (left + right)),
                coordinate(0.5 * (top + bottom))
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

/// Grows `interval` to `size` about its middle, or upwards from a floor on which it stands.
fn widen(interval: &mut [f64; 2], size: f64, floor: Option<f64>) {
    let missing = size - (interval[1] - interval[0]);
    if missing <= 0.0 {
        return;
    }
    let below = if floor.is_some_and(|f| interval[0] <= f) {
        0.0
    } else {
        0.5 * missing
    };
    *interval = [interval[0] - below, interval[1] + missing - below];
}

#[cfg(test)]
mod tests {
    use super::*;

    fn attribute(document: &roxmltree::Document<'_>, tag: &str, name: &str) -> f64 {
        let node = document
            .descendants()
            .filter(|n| n.has_tag_name(tag))
            .find_map(|n| n.attribute(name));
        node.unwrap().parse().unwrap()
    }

    #[test]
    fn a_metre_is_as_long_upwards_as_it_is_sideways() {
        for corner in [[4.0, 1.0], [1.0, 4.0], [0.2, 0.3]] {
            let [x, y] = corner;
            let plan = Plan::new("p", Axis::new("x", "m"), Axis::new("y", "m")).outline(
                Outline::polygon(vec![[0.0, 0.0], [x, 0.0], [x, y], [0.0, y]]),
            );
            let svg = plan.svg("p", NARROW);
            let document = roxmltree::Document::parse(&svg).unwrap();
            let d = document
                .descendants()
                .find(|n| n.attribute("class").is_some_and(|c| c.starts_with("shape")))
                .unwrap();
            let numbers: Vec<f64> = d
                .attribute("d")
                .unwrap()
                .split(['M', 'L', 'Z', ' '])
                .filter_map(|t| t.parse().ok())
                .collect();
            let (across, up) = (numbers[2] - numbers[0], numbers[3] - numbers[5]);
            // Coordinates are rounded to a hundredth.
            assert!((across / x - up / y).abs() < 0.02 / x.min(y), "{numbers:?}");
        }
    }

    #[test]
    fn the_legend_leaves_out_what_is_out_of_view() {
        let square = |size: f64| {
            Outline::polygon(vec![
                [-size, -size],
                [size, -size],
                [size, size],
                [-size, size],
            ])
        };
        let plan = |size: f64| {
            Plan::new("p", Axis::new("x", "m"), Axis::new("y", "m"))
                .outline(square(size).context().label("workspace"))
                .outline(square(1.0).label("rod"))
        };
        assert!(plan(1.1).svg("p", NARROW).contains("workspace"));
        assert!(!plan(50.0).svg("p", NARROW).contains("workspace"));
    }

    #[test]
    fn nothing_to_show_says_so_and_odd_points_are_skipped() {
        let plan = Plan::new("p", Axis::new("x", "m"), Axis::new("y", "m"));
        assert!(plan.svg("p", NARROW).contains("no data"));
        let odd = plan
            .outline(Outline::polygon(vec![
                [f64::NAN, 0.0],
                [0.0, 1.0],
                [1.0, f64::INFINITY],
            ]))
            .outline(Outline::circle([f64::NAN, 0.0], 1.0))
            .outline(Outline::trail(vec![[0.0, 0.0], [f64::NAN, 1.0]]));
        let svg = odd.svg("p", NARROW);
        let document = roxmltree::Document::parse(&svg).unwrap();
        assert!(!svg.contains("NaN") && attribute(&document, "circle", "r") > 0.0);
    }
}
