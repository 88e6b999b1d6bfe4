//! Draws a task's scene from above, to scale, as SVG on standard output:
//!
//!     cargo run -p asid-tasks --example top_view -- shuffleboard > docs/images/shuffleboard.svg

#![allow(clippy::print_stdout)]

use std::fmt::Write as _;

use asid_core::registry::{TaskEntry, find};
use asid_core::task::{Outline, Task};
use asid_tasks as _;

/// Width of the picture, pixels.
const WIDTH: f64 = 760.0;

/// Fill colours of the fixtures, in their order.
const FILLS: [&str; 6] = [
    "#ead9bd", "#f2d95c", "#7fa7dd", "#b9d8a8", "#d9b8d8", "#c9c9c9",
];

fn main() -> asid_core::Result<()> {
    let name = std::env::args().nth(1).unwrap_or_default();
    let task = (find::<TaskEntry>(&name)?.make)()?;
    println!("{}", svg(&*task));
    Ok(())
}

/// Draws the top view with x to the right and y up.
fn svg(task: &dyn Task) -> String {
    let view = &task.spec().top_view;
    let [low, high] = view.bounds;
    let scale = WIDTH / (high[0] - low[0]);
    let height = scale * (high[1] - low[1]);
    let pixel = |[x, y]: [f64; 2]| [scale * (x - low[0]), scale * (high[1] - y)];
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH:.0} {height:.0}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<title>{} from above, to scale</title>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
        task.name()
    );
    let mut draw = |outline: &Outline, at: [f64; 3], fill: &str| {
        let (sin, cos) = at[2].sin_cos();
        let corners: Vec<[f64; 2]> = outline
            .corners
            .iter()
            .map(|[x, y]| pixel([at[0] + cos * x - sin * y, at[1] + sin * x + cos * y]))
            .collect();
        let points: Vec<String> = corners
            .iter()
            .map(|[x, y]| format!("{x:.1},{y:.1}"))
            .collect();
        let n = corners.len().max(1) as f64;
        let middle = corners.iter().map(|c| c[0]).sum::<f64>() / n;
        let bottom = corners.iter().map(|c| c[1]).fold(0.0, f64::max);
        let _ = writeln!(
            text,
            "<polygon points=\"{}\" fill=\"{fill}\" stroke=\"#444\"/>\n\
             <text x=\"{middle:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{}</text>",
            points.join(" "),
            bottom + 14.0,
            outline.label
        );
    };
    for (fixture, fill) in view.fixtures.iter().zip(FILLS.iter().cycle()) {
        draw(fixture, [0.0; 3], fill);
    }
    let start = &task.exploration().start;
    let at = ["x", "y", "yaw"].map(|name| {
        let found = start.iter().find(|c| c.name == name);
        found.map_or(0.0, |c| c.center())
    });
    draw(&view.object, at, "#c23b3b");
    let [x, y] = [14.0, height - 12.0];
    let bar = 0.1 * scale;
    let _ = write!(
        text,
        "<path d=\"M{x} {y:.1}h{bar:.1}\" stroke=\"#000\" stroke-width=\"3\"/>\n\
         <text x=\"{x}\" y=\"{:.0}\">0.1 m; x to the right, y up</text>\n</svg>",
        y - 6.0
    );
    text
}
