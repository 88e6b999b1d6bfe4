//! Pushes from start positions, and with a mass, outside the training data.

use anyhow::Result;
use asid_learned::shipped;
use asid_report::plot::Colour;

use super::displacement::HIT;
use super::episodes::{Played, play};
use super::map::{Grid, frame};
use super::variant::Variant;
use super::wanted::{Wanted, playable};
use super::{Claim, Data, Drawing, Number, Panel, Request, share, task};
use crate::cli::settings::wrong;

/// Task without walls, so that the ball may lie anywhere.
const TASK: &str = "sphere-free";

/// Sensor of the ball's position.
const BALL: &str = "ball_pos";

/// Truths a square, as many as in the paper. Each square has its own, so that no two episodes share
/// one.
const EPISODES: u64 = 5;

/// Required share of pushes within the training box.
const INSIDE: f64 = 0.8;

/// Required share of pushes outside the training box, where the arm does not reach every start.
const OUTSIDE: f64 = 0.2;

/// How far beyond the training box the map reaches, m.
const BEYOND: f64 = 0.15;

/// Ratio of the ball's mass to that of training.
const MASS: f64 = 3.0;

pub fn draw(request: &Request<'_>) -> Result<Drawing> {
    let task = task(TASK)?;
    let (explorers, mut notes) = playable(request, TASK, &[own()])?;
    let [explorer] = &explorers[..] else {
        return Err(wrong(
            "--explorer",
            "the figure `generalization` shows one explorer: name one",
        ));
    };
    let label = Variant::of(explorer).label();
    if !Variant::of(explorer).learns()? {
        notes.push(format!(
            "{label} is not trained; the training box is that of the task's starts"
        ));
    }
    let episodes = request.episodes(1, EPISODES);
    let start = &task.exploration().start;
    let trained = [0, 1].map(|end| [start[0].range[end], start[1].range[end]]);
    let around = [
        trained[0].map(|x| x - BEYOND),
        trained[1].map(|x| x + BEYOND),
    ];
    let grid = Grid::over(around, if request.quick { 0.13 } else { 0.05 });
    let cases = [
        ("friction within the prior", Vec::new()),
        (
            "mass never trained on",
            vec![format!("mass@ball:factor={MASS}")],
        ),
    ];
    let mut wanted = Vec::new();
    for (_, effects) in &cases {
        for square in 0..grid.len() {
            wanted.extend((0..episodes).map(|k| Wanted {
                task: TASK.into(),
                explorer: explorer.clone(),
                set: Vec::new(),
                effects: effects.clone(),
                seed: request.seed() + square as u64 * episodes + k,
                start: Some(grid.middle(square).to_vec()),
            }));
        }
    }
    let played = play(&request.common, wanted)?;
    let mut drawing = Drawing {
        data: vec![Data::new(
            "pushes.csv",
            &["case", "seed", "x", "y", "displacement_m"],
        )],
        notes,
        ..Drawing::new(
            "Pushes where nothing was trained",
            format!(
                "Share of {episodes} truths a square in which {label} pushes the ball by more than {HIT} m on {TASK}, \
             over where the ball lies; on the right its mass is {MASS} times that of training. Each episode of a map \
             has a truth of its own."
            ),
        )
    };
    let each = grid.len() * episodes as usize;
    for ((case, _), of) in cases.iter().zip(played.chunks_exact(each)) {
        let mut values = vec![0.0; grid.len()];
        // Hits and episodes, inside and outside the training box.
        let mut counts = [[0_usize; 2]; 2];
        for (square, here) in of.chunks_exact(episodes as usize).enumerate() {
            let [x, y] = grid.middle(square);
            let inside = (0..2).all(|i| (trained[0][i]..=trained[1][i]).contains(&[x, y][i]));
            for episode in here {
                let moved = episode.displacement(BALL)?;
                let hit = usize::from(moved > HIT);
                values[square] += hit as f64 / episodes as f64;
                counts[usize::from(!inside)][0] += hit;
                counts[usize::from(!inside)][1] += 1;
                drawing.data[0].rows.push(row(case, episode, [x, y], moved));
            }
        }
        for (place, [hits, n]) in ["inside", "outside"].iter().zip(counts) {
            let quantity = format!("{case}, {place} the training box: episodes that push the ball");
            drawing.numbers.push(share(&label, &quantity, hits, n));
        }
        let plan = grid.plan(case, &values, 1.0, Colour::Blue).outline(frame(
            trained,
            "starts of training",
            Colour::Purple,
        ));
        drawing
            .panels
            .push(Panel::new(case, plan, "Dark: pushed at every truth."));
    }
    drawing.claims = claims(&drawing.numbers);
    Ok(drawing)
}

fn row(case: &str, episode: &Played, [x, y]: [f64; 2], moved: f64) -> Vec<String> {
    let head = [case.to_owned(), episode.wanted.seed.to_string()];
    let cells = [x, y, moved].map(|v| format!("{v:.4}"));
    [&head[..], &cells].concat()
}

/// The explorer shipped for the task, as in the paper; else the search that needs no training.
fn own() -> &'static str {
    match shipped::find(TASK, "fisher-ppo") {
        Some(_) => "fisher-ppo",
        None => "fisher-cem",
    }
}

/// Claim: the intervals of the shares of pushes lie wholly above the required shares.
fn claims(numbers: &[Number]) -> Vec<Claim> {
    let [inside, outside, heavy, _] = numbers else {
        return Vec::new();
    };
    let asked = [(inside, INSIDE), (heavy, INSIDE), (outside, OUTSIDE)];
    vec![Claim::new(
        format!(
            "the ball is pushed in {:.0} % inside of the training box, {:.0} % outside, and {:.0} % inside with another mass",
            100.0 * inside.value,
            100.0 * outside.value,
            100.0 * heavy.value
        ),
        "pushes generalise to starts that the arm reaches and to other masses (figure 13)",
        asked.iter().map(|(share, _)| share.n),
        asked
            .iter()
            .all(|(share, least)| share.interval95[0] > *least),
    )]
}

#[cfg(test)]
mod tests {
    use super::super::claim::Verdict;
    use super::*;

    #[test]
    fn the_figures_own_explorer_can_be_played_as_it_ships() {
        assert_eq!(Variant::of(own()).lacks(TASK).unwrap(), None);
    }

    #[test]
    fn pushes_generalize_where_their_intervals_are_above_what_is_asked_for() {
        let verdict = |hits: [usize; 4], n: usize| {
            let numbers = hits.map(|hits| share("a", "", hits, n));
            claims(&numbers)[0].verdict
        };
        assert_eq!(verdict([40, 20, 40, 0], 40), Verdict::Agrees);
        // 90 % is above 80 % by its value, but not by its whole interval.
        assert_eq!(verdict([36, 20, 40, 0], 40), Verdict::Differs);
        assert_eq!(verdict([5; 4], 5), Verdict::TooFewEpisodes);
    }
}
