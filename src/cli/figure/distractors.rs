//! Which of four balls an explorer pushes: one has an unknown friction, three do not matter.

use anyhow::Result;
use asid_report::plot::{Axis, Colour, Outline, Plan};

use super::displacement::HIT;
use super::episodes::{by_explorer, of_each, play, playable};
use super::map::with_fixtures;
use super::{Claim, Data, Drawing, Panel, Request, mean, share, task};

const TASK: &str = "sphere-distractors";

/// Episodes of an explorer, as in the paper.
const EPISODES: u64 = 30;

pub fn draw(request: &Request<'_>) -> Result<Drawing> {
    let task = task(TASK)?;
    let (explorers, notes) = playable(request, TASK, &["random", "max", "fisher-ppo"])?;
    let episodes = request.episodes(4, EPISODES);
    let wanted = of_each(TASK, &explorers, &[], request.seed(), episodes);
    let played = play(&request.common, wanted)?;
    // The task's signals: the ball that matters first, then the others.
    let signals = &task.exploration().signals;
    let balls: Vec<&str> = signals
        .iter()
        .map(|s| &*s.sensor)
        .filter(|s| s.ends_with("_pos"))
        .collect();
    let mut drawing = Drawing {
        data: vec![Data::new(
            "balls.csv",
            &["explorer", "seed", "ball", "displacement_m"],
        )],
        notes,
        ..Drawing::new(
            "Which ball is pushed",
            format!(
                "{episodes} exploration episodes of each explorer on {TASK}. The friction of the first ball is \
             unknown; that of the other three is known, and pushing them tells nothing."
            ),
        )
    };
    for (explorer, of) in by_explorer(&explorers, &played) {
        let explorer = &*explorer;
        let mut plan = Plan::new(explorer, Axis::new("x", "m"), Axis::new("y", "m"));
        let (mut matters, mut others) = (Vec::new(), Vec::new());
        let mut hits = vec![0; balls.len()];
        for episode in &of {
            let mut pushed = Vec::new();
            for (b, ball) in balls.iter().enumerate() {
                let way = episode.displacement(ball)?;
                hits[b] += usize::from(way > HIT);
                pushed.push(if way > HIT { way } else { 0.0 });
                let head = [explorer.to_owned(), episode.wanted.seed.to_string()];
                let cells = [(*ball).to_owned(), format!("{way:.4}")];
                drawing.data[0].rows.push([&head[..], &cells].concat());
                let colour = if b == 0 {
                    Colour::Vermillion
                } else {
                    Colour::Blue
                };
                plan = plan.outline(
                    Outline::path(episode.path(ball)?)
                        .colour(colour)
                        .strength(0.0, 0.5),
                );
            }
            matters.push(pushed[0]);
            others.push(pushed[1..].iter().sum());
        }
        drawing.numbers.push(mean(
            explorer,
            "displacement of the ball that matters",
            "m",
            &matters,
        ));
        drawing.numbers.push(mean(
            explorer,
            "displacement of the others together",
            "m",
            &others,
        ));
        for (b, ball) in balls.iter().enumerate() {
            drawing.numbers.push(share(
                explorer,
                &format!("episodes that push {ball}"),
                hits[b],
                of.len(),
            ));
        }
        let caption = "Ways of the balls; red: the one of unknown friction.";
        let plan = with_fixtures(plan, &*task);
        drawing.panels.push(Panel::new(explorer, plan, caption));
    }
    drawing.claims = claims(&drawing);
    Ok(drawing)
}

/// Share of all displacement that goes to the ball that matters.
fn focus(drawing: &Drawing, name: &str) -> Option<(String, f64)> {
    let of = |quantity: &str| {
        let mut numbers = drawing.numbers.iter();
        numbers.find(|n| n.explorer.starts_with(name) && n.quantity.starts_with(quantity))
    };
    let (own, rest) = (
        of("displacement of the ball")?,
        of("displacement of the others")?,
    );
    Some((
        own.explorer.clone(),
        own.value / (own.value + rest.value).max(1e-9),
    ))
}

fn claims(drawing: &Drawing) -> Vec<Claim> {
    let (Some((fisher, own)), Some((max, theirs))) =
        (focus(drawing, "fisher"), focus(drawing, "max"))
    else {
        return Vec::new();
    };
    vec![Claim {
        statement: format!(
            "{:.0} % of what {fisher} pushes is the ball that matters, {:.0} % of what {max} pushes",
            100.0 * own,
            100.0 * theirs
        ),
        paper: "Fisher exploration seeks out the one sphere, MAX is distracted by all (figure 10)"
            .into(),
        holds: own > theirs && own > 0.5,
    }]
}
