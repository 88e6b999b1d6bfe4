//! How often exploration moves the lid of a laptop.

use anyhow::Result;
use asid_core::signal::rotation_difference;
use asid_report::plot::{Colour, Outline};

use super::episodes::{Played, play};
use super::map::with_fixtures;
use super::wanted::{by_explorer, of_each, playable};
use super::{Claim, Data, Drawing, Panel, Request, share, task};

const TASK: &str = "laptop-articulation";

/// Smallest turn that counts as a moved lid, rad (ASID, appendix: change of the lid's angle above
/// 1e-2).
const MOVED: f64 = 0.01;

/// Least share of episodes in which Fisher exploration moves the lid, as in the paper.
const FISHER: f64 = 0.8;

/// Largest share of episodes in which random actions move the lid: half that of Fisher exploration.
const RANDOM: f64 = 0.4;

/// Episodes of an explorer.
const EPISODES: u64 = 40;

pub fn draw(request: &Request<'_>) -> Result<Drawing> {
    let task = task(TASK)?;
    let (explorers, notes) = playable(request, TASK, &["random", "fisher-cem"])?;
    let episodes = request.episodes(4, EPISODES);
    // The paper evaluates with a lid that turns.
    let wanted = of_each(
        TASK,
        &explorers,
        &["condition=\"articulated\""],
        request.seed(),
        episodes,
    );
    let played = play(&request.common, wanted)?;
    let mut drawing = Drawing {
        data: vec![Data::new(
            "lid.csv",
            &[
                "explorer",
                "seed",
                "x",
                "y",
                "yaw",
                "lid_turned_rad",
                "contact_fraction",
            ],
        )],
        notes,
        ..Drawing::new(
            "How often the lid is moved",
            format!(
                "{episodes} exploration episodes of each explorer on {TASK}, whose lid turns. The lid counts as moved if \
             it turns relative to the base by more than {MOVED} rad. Dots show where the laptop stood."
            ),
        )
    };
    for (explorer, of) in by_explorer(&explorers, &played) {
        let explorer = &*explorer;
        let (mut moved, mut still) = (Vec::new(), Vec::new());
        for episode in &of {
            let turned = lid_turned(episode)?;
            let place = [episode.start[0], episode.start[1]];
            if turned > MOVED {
                moved.push(place);
            } else {
                still.push(place);
            }
            let numbers = episode
                .start
                .iter()
                .take(3)
                .chain([&turned, &episode.contact_fraction]);
            let head = [explorer.to_owned(), episode.wanted.seed.to_string()];
            let cells: Vec<String> = numbers.map(|v| format!("{v:.4}")).collect();
            drawing.data[0].rows.push([&head[..], &cells].concat());
        }
        drawing.numbers.push(share(
            explorer,
            "episodes in which the lid is moved",
            moved.len(),
            of.len(),
        ));
        let touched = of.iter().filter(|p| p.contact_fraction > 0.0).count();
        drawing
            .numbers
            .push(share(explorer, "episodes with contact", touched, of.len()));
        let axis = asid_report::plot::Axis::new;
        let plan = asid_report::plot::Plan::new(explorer, axis("x", "m"), axis("y", "m"))
            .outline(
                Outline::spots(moved)
                    .colour(Colour::Blue)
                    .label("lid moved"),
            )
            .outline(
                Outline::spots(still)
                    .colour(Colour::Vermillion)
                    .label("not moved"),
            );
        let plan = with_fixtures(plan, &*task);
        drawing
            .panels
            .push(Panel::new(explorer, plan, "A dot an episode."));
    }
    drawing.claims = claims(&drawing);
    Ok(drawing)
}

/// Largest angle between lid and base relative to the start, rad.
fn lid_turned(episode: &Played) -> Result<f64> {
    let (base, lid) = (episode.channel("base_quat")?, episode.channel("lid_quat")?);
    let relative = |k: usize| {
        let unit = asid_core::signal::unit_quaternion;
        let turn = unit(base[k]).inverse() * unit(lid[k]);
        [turn.w, turn.i, turn.j, turn.k]
    };
    let first = relative(0);
    let angle = |k: usize| {
        let turn = rotation_difference(&relative(k), &first);
        turn.iter().map(|x| x * x).sum::<f64>().sqrt()
    };
    Ok((0..base.len()).map(angle).fold(0.0, f64::max))
}

/// Claims: Fisher exploration moves the lid more often than random actions, with intervals apart,
/// and the shares are about those of the paper.
fn claims(drawing: &Drawing) -> Vec<Claim> {
    let moved = |name: &str| {
        let mut numbers = drawing.numbers.iter();
        numbers.find(|n| n.quantity.ends_with("moved") && n.explorer.starts_with(name))
    };
    let (Some(fisher), Some(random)) = (moved("fisher"), moved("random")) else {
        return Vec::new();
    };
    let apart = fisher.interval95[0] > random.interval95[1];
    vec![Claim::new(
        format!(
            "{} moves the lid in {:.0} % of episodes, random actions in {:.0} %",
            fisher.explorer,
            100.0 * fisher.value,
            100.0 * random.value
        ),
        "80 % against 20 % (section 5.2)",
        [fisher.n, random.n],
        apart && fisher.value >= FISHER && random.value <= RANDOM,
    )]
}

#[cfg(test)]
mod tests {
    use super::super::claim::Verdict;
    use super::*;

    #[test]
    fn a_lid_moved_more_often_agrees_only_with_enough_episodes_and_intervals_apart() {
        let verdict = |fisher: usize, random: usize, n: usize| {
            let moved = |name, hits| share(name, "episodes in which the lid is moved", hits, n);
            let drawing = Drawing {
                numbers: vec![moved("random", random), moved("fisher-cem", fisher)],
                ..Drawing::default()
            };
            claims(&drawing)[0].verdict
        };
        assert_eq!(verdict(40, 5, 40), Verdict::Agrees);
        assert_eq!(verdict(20, 5, 40), Verdict::Differs);
        // 100 % against 33 %: the intervals overlap.
        assert_eq!(verdict(6, 2, 6), Verdict::Differs);
        assert_eq!(verdict(4, 0, 4), Verdict::TooFewEpisodes);
    }
}
