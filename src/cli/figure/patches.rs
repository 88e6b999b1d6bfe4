//! Where the ball goes on three patches of friction. Each patch reveals only its own friction, so
//! an explorer that targets the unknowns sends the ball over all of them.

use anyhow::Result;
use asid_core::task::Outline;
use asid_report::plot::Colour;

use super::episodes::play;
use super::map::{Grid, with_fixtures};
use super::wanted::{by_explorer, of_each, playable};
use super::{Claim, Data, Drawing, Panel, Request, mean, share, task};

const TASK: &str = "sphere-patches";

/// Sensor of the ball's position.
const BALL: &str = "ball_pos";

/// Side of a square of the map, m: about the ball's diameter (0.06 m).
const SIDE: f64 = 0.05;

/// Episodes of an explorer; the paper gives no number for its heat maps.
const EPISODES: u64 = 20;

pub fn draw(request: &Request<'_>) -> Result<Drawing> {
    let task = task(TASK)?;
    let (explorers, notes) = playable(request, TASK, &["random", "maxmi", "fisher-ppo"])?;
    let episodes = request.episodes(4, EPISODES);
    let wanted = of_each(TASK, &explorers, &[], request.seed(), episodes);
    let played = play(&request.common, wanted)?;
    let grid = Grid::over(task.spec().top_view.bounds, SIDE);
    let regions = &task.spec().regions;
    let mut drawing = Drawing {
        data: vec![Data::new(
            "visits.csv",
            &["explorer", "x", "y", "share_of_episodes"],
        )],
        notes,
        ..Drawing::new(
            "Where the ball goes",
            format!(
                "{episodes} exploration episodes of each explorer on {TASK}; a square is as dark as the share of \
             episodes whose ball was in it."
            ),
        )
    };
    for (explorer, of) in by_explorer(&explorers, &played) {
        let explorer = &*explorer;
        let mut visits = vec![0.0; grid.len()];
        let (mut covered, mut everywhere) = (Vec::new(), 0);
        for episode in &of {
            let path = episode.path(BALL)?;
            let mut seen = vec![false; grid.len()];
            for square in path.iter().filter_map(|p| grid.square(*p)) {
                seen[square] = true;
            }
            for (sum, seen) in visits.iter_mut().zip(&seen) {
                *sum += f64::from(u8::from(*seen)) / of.len() as f64;
            }
            covered.push(seen.iter().filter(|s| **s).count() as f64 * SIDE * SIDE);
            let visited = |region: &Outline| path.iter().any(|p| inside(region, *p));
            everywhere += usize::from(regions.iter().all(visited));
        }
        for (square, share) in visits.iter().enumerate().filter(|(_, s)| **s > 0.0) {
            let [x, y] = grid.middle(square);
            let cells = [x, y, *share].map(|v| format!("{v:.4}"));
            drawing.data[0]
                .rows
                .push([&[explorer.to_owned()][..], &cells].concat());
        }
        drawing
            .numbers
            .push(mean(explorer, "area covered in an episode", "m²", &covered));
        drawing.numbers.push(share(
            explorer,
            "episodes that visit every patch",
            everywhere,
            of.len(),
        ));
        let plan = with_fixtures(grid.plan(explorer, &visits, 1.0, Colour::Blue), &*task);
        let caption = "Dark: every episode; white: none.";
        drawing.panels.push(Panel::new(explorer, plan, caption));
    }
    drawing.claims = claims(&drawing);
    Ok(drawing)
}

/// Whether a place lies between the corners of a region.
fn inside(region: &Outline, place: [f64; 2]) -> bool {
    (0..2).all(|i| {
        let along = || region.corners.iter().map(|c| c[i]);
        let (low, high) = (
            along().fold(f64::INFINITY, f64::min),
            along().fold(f64::NEG_INFINITY, f64::max),
        );
        (low..=high).contains(&place[i])
    })
}

/// Claim: Fisher exploration covers more than MaxMI, with intervals apart.
fn claims(drawing: &Drawing) -> Vec<Claim> {
    let covered = |name: &str| {
        let mut numbers = drawing.numbers.iter();
        numbers.find(|n| n.unit == "m²" && n.explorer.starts_with(name))
    };
    let (Some(fisher), Some(maxmi)) = (covered("fisher"), covered("maxmi")) else {
        return Vec::new();
    };
    vec![Claim::new(
        format!(
            "{} covers {:.3} m² an episode, maxmi {:.3} m²: {:.1} times as much",
            fisher.explorer,
            fisher.value,
            maxmi.value,
            fisher.value / maxmi.value
        ),
        "ASID activates the sphere over a much larger area than MaxMI (figure 4)",
        [fisher.n, maxmi.n],
        fisher.interval95[0] > maxmi.interval95[1],
    )]
}
