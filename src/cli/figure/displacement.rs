//! How far the ball is pushed from each start position.

use anyhow::Result;
use asid_report::plot::{Colour, Outline};

use super::episodes::play;
use super::map::{Grid, frame, with_fixtures};
use super::wanted::{Wanted, by_explorer, playable};
use super::{Claim, Data, Drawing, Panel, Request, mean, share, task};

const TASK: &str = "sphere-striking";

/// Sensor of the ball's position.
const BALL: &str = "ball_pos";

/// Smallest displacement that counts as a hit, m: half the ball's radius.
pub const HIT: f64 = 0.015;

/// Displacement that gets the darkest colour, m.
const FULL: f64 = 0.5;

pub fn draw(request: &Request<'_>) -> Result<Drawing> {
    let task = task(TASK)?;
    let (explorers, notes) = playable(request, TASK, &["random", "task-ppo", "fisher-ppo"])?;
    let start = &task.exploration().start;
    let corners = [0, 1].map(|end| [start[0].range[end], start[1].range[end]]);
    let grid = Grid::over(corners, if request.quick { 0.08 } else { 0.03 });
    let episodes = request.episodes.unwrap_or(1);
    let mut wanted = Vec::new();
    for explorer in &explorers {
        for square in 0..grid.len() {
            wanted.extend((0..episodes).map(|k| Wanted {
                task: TASK.into(),
                explorer: explorer.clone(),
                set: Vec::new(),
                effects: Vec::new(),
                seed: request.seed() + square as u64 * episodes + k,
                start: Some(grid.middle(square).to_vec()),
            }));
        }
    }
    let played = play(&request.common, wanted)?;
    let mut drawing = Drawing {
        data: vec![Data::new(
            "displacement.csv",
            &["explorer", "seed", "x", "y", "displacement_m"],
        )],
        notes,
        ..Drawing::new(
            "How far the ball is pushed",
            format!(
                "Displacement of the ball after one exploration episode on {TASK}, over where it lay at the start. \
             Below {HIT} m it was not hit; the darkest square is {FULL} m or more."
            ),
        )
    };
    for (explorer, of) in by_explorer(&explorers, &played) {
        let explorer = &*explorer;
        let mut values = vec![0.0; grid.len()];
        let (mut all, mut hits) = (Vec::new(), 0);
        for (k, episode) in of.iter().enumerate() {
            let moved = episode.displacement(BALL)?;
            values[k / episodes as usize] += moved / episodes as f64;
            hits += usize::from(moved > HIT);
            all.push(moved);
            let cells = [episode.start[0], episode.start[1], moved].map(|v| format!("{v:.4}"));
            let head = [explorer.to_owned(), episode.wanted.seed.to_string()];
            drawing.data[0].rows.push([&head[..], &cells].concat());
        }
        drawing
            .numbers
            .push(mean(explorer, "mean displacement", "m", &all));
        drawing.numbers.push(share(
            explorer,
            "episodes in which the ball is hit",
            hits,
            of.len(),
        ));
        let plan = with_fixtures(grid.plan(explorer, &values, FULL, Colour::Blue), &*task);
        let plan = plan.outline(frame(corners, "starts", Colour::Purple));
        let hand = of[0].path("ee_pos")?[0];
        let plan = plan.outline(
            Outline::circle(hand, 0.012)
                .colour(Colour::Vermillion)
                .strength(0.9, 1.0)
                .label("hand at the start"),
        );
        drawing
            .panels
            .push(Panel::new(explorer, plan, "Dark: pushed far."));
    }
    drawing.claims = claims(&drawing);
    Ok(drawing)
}

/// Claim: Fisher exploration hits the ball more often than random actions, with intervals apart.
fn claims(drawing: &Drawing) -> Vec<Claim> {
    let hit = |name: &str| {
        let mut numbers = drawing.numbers.iter();
        numbers.find(|n| n.unit.is_empty() && n.explorer.starts_with(name))
    };
    let (Some(fisher), Some(random)) = (hit("fisher"), hit("random")) else {
        return Vec::new();
    };
    vec![Claim::new(
        format!(
            "{} hits the ball in {:.0} % of episodes, random actions in {:.0} %",
            fisher.explorer,
            100.0 * fisher.value,
            100.0 * random.value
        ),
        "Fisher exploration displaces the sphere from every start, random actions hardly (figure 7)",
        [fisher.n, random.n],
        fisher.interval95[0] > random.interval95[1],
    )]
}
