//! The real episode, seen from above.

use super::trace::{Episode, ObjectTrack, RunReport, Shape, ShapeKind};
use crate::markup::capitalise;
use crate::number::decimals;
use crate::page::{Figure, Section};
use crate::plot::{Axis, Colour, Outline, Plan};

/// Outlines drawn between the first and the last pose.
const GHOSTS: usize = 5;

pub(super) fn section(report: &RunReport) -> Option<Section> {
    let (title, which) = if report.predicted() {
        (
            "The predicted episode",
            "the episode that the simulator expects",
        )
    } else {
        (
            "The real episode",
            "the one episode that all conclusions rest on",
        )
    };
    let section = Section::new(title);
    let Some(episode) = &report.episode else {
        if !report.stage.is_empty() {
            return None;
        }
        return Some(section.note(if report.explorer.is_empty() {
            "No view from above: nothing was explored."
        } else {
            "No view from above: the run has no real episode with tracked objects."
        }));
    };
    let names: Vec<&str> = episode
        .objects
        .iter()
        .map(|o| o.name.as_str())
        .filter(|n| !n.is_empty())
        .collect();
    let what = if names.is_empty() {
        "the objects".to_owned()
    } else {
        format!("the {}", names.join(" and the "))
    };
    let moves: Vec<String> = episode
        .objects
        .iter()
        .map(|o| format!("the {} moved {}", name_of(o), displacement(o)))
        .collect();
    let lead = format!(
        "Seen from above: {which}. {}.",
        capitalise(&moves.join("; "))
    );
    let dots = if episode.end_effector.is_some() {
        "; each dot is one control step"
    } else {
        ""
    };
    let caption = format!("Faint is early, strong is late. Both axes have the same scale{dots}.");
    let figure = Figure::new(
        format!("Path of the end effector and of {what}"),
        plan(episode, title),
        caption,
    );
    Some(section.lead(lead).figures(vec![figure]))
}

fn plan(episode: &Episode, title: &str) -> Plan {
    let mut plan = Plan::new(&format!("{title} seen from above"), Axis::new("x", "m"), Axis::new("y", "m"))
        .description("Outlines of the objects from start to end, the path of the end effector, and what stands around them.");
    if let Some([x0, x1, y0, y1]) = episode.workspace {
        let corners = vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
        plan = plan.outline(
            Outline::polygon(corners)
                .colour(Colour::Muted)
                .strength(0.0, 0.6)
                .dashed()
                .context()
                .label("workspace"),
        );
    }
    for shape in &episode.shapes {
        let goal = shape.kind == ShapeKind::Goal;
        let outline = outline_of(shape);
        plan = plan.outline(if goal { outline } else { outline.context() });
    }
    const COLOURS: [Colour; 3] = [Colour::Blue, Colour::Purple, Colour::Ochre];
    for (track, colour) in episode.objects.iter().zip(COLOURS.into_iter().cycle()) {
        for outline in ghosts(track, colour) {
            plan = plan.outline(outline);
        }
    }
    if let Some(path) = &episode.end_effector {
        plan = plan
            .outline(
                Outline::path(path.position.clone())
                    .colour(Colour::Vermillion)
                    .strength(0.0, 0.35),
            )
            .outline(
                Outline::trail(path.position.clone())
                    .colour(Colour::Vermillion)
                    .label(span("end effector", &path.time)),
            );
    }
    plan
}

/// The shape in the colours of its kind.
pub(super) fn outline_of(shape: &Shape) -> Outline {
    let outline = match (shape.radius, shape.points.first()) {
        (Some(radius), Some(&center)) => Outline::circle(center, radius),
        _ => Outline::polygon(shape.points.clone()),
    };
    let outline = match shape.kind {
        ShapeKind::Fixed => outline.colour(Colour::Muted).strength(0.14, 0.7),
        ShapeKind::Goal => outline.colour(Colour::Green).strength(0.16, 0.9),
        ShapeKind::Object => outline.colour(Colour::Blue).strength(0.16, 1.0),
        ShapeKind::Part => outline.colour(Colour::Ink).strength(0.55, 0.9),
        ShapeKind::Robot => outline.colour(Colour::Vermillion).strength(0.2, 0.9),
    };
    if shape.label.is_empty() {
        outline
    } else {
        outline.label(shape.label.clone())
    }
}

/// Display name of an object.
fn name_of(track: &ObjectTrack) -> &str {
    if track.name.is_empty() {
        "object"
    } else {
        &track.name
    }
}

/// Outlines of an object at evenly spaced times, faint to strong.
fn ghosts(track: &ObjectTrack, colour: Colour) -> Vec<Outline> {
    let poses: Vec<&[f64; 3]> = track
        .poses
        .iter()
        .filter(|p| p.iter().all(|c| c.is_finite()))
        .collect();
    if poses.is_empty() || track.outline.is_empty() {
        return Vec::new();
    }
    let count = (GHOSTS + 2).min(poses.len());
    (0..count)
        .map(|i| {
            let share = if count == 1 {
                1.0
            } else {
                i as f64 / (count - 1) as f64
            };
            let pose = poses[(share * (poses.len() - 1) as f64).round() as usize];
            let outline = Outline::polygon(placed(&track.outline, *pose)).colour(colour);
            if i + 1 == count {
                let label = span(name_of(track), &track.time);
                outline.strength(0.2, 1.0).series_label(label)
            } else {
                outline.strength(0.03, 0.25 + 0.4 * share)
            }
        })
        .collect()
}

/// `outline` moved from its own frame to `world_from_object = [x, y, yaw]`.
fn placed(outline: &[[f64; 2]], [x, y, yaw]: [f64; 3]) -> Vec<[f64; 2]> {
    let (sin, cos) = yaw.sin_cos();
    outline
        .iter()
        .map(|p| [x + cos * p[0] - sin * p[1], y + sin * p[0] + cos * p[1]])
        .collect()
}

/// `name, 0 to 2.0 s`.
fn span(name: &str, time: &[f64]) -> String {
    match (time.first(), time.last()) {
        (Some(first), Some(last)) if first.is_finite() && last.is_finite() => {
            format!(
                "{name}, {} to {} s",
                decimals(*first, 1),
                decimals(*last, 1)
            )
        }
        _ => name.to_owned(),
    }
}

/// `by 0.12 m and turned by 34°`; for a round object only the distance.
fn displacement(track: &ObjectTrack) -> String {
    let mut poses = track
        .poses
        .iter()
        .filter(|p| p.iter().all(|c| c.is_finite()));
    match (poses.next(), poses.next_back()) {
        (Some(a), Some(b)) => {
            let way = decimals((b[0] - a[0]).hypot(b[1] - a[1]), 2);
            if track.round {
                return format!("by {way} m");
            }
            let turn = decimals((b[2] - a[2]).to_degrees(), 0);
            format!("by {way} m and turned by {turn}°")
        }
        _ => "by an unknown distance".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Domain randomisation and the oracle do not explore.
    #[test]
    fn a_run_without_an_explorer_says_so() {
        let report = RunReport::default();
        assert!(report.html().contains("nothing was explored"));
    }

    #[test]
    fn a_round_thing_moves_and_does_not_turn() {
        let ball = ObjectTrack {
            name: "ball".into(),
            round: true,
            time: vec![0.0, 1.0, 2.0],
            poses: vec![[0.0; 3], [f64::NAN; 3], [0.3, 0.4, 0.0]],
            ..ObjectTrack::default()
        };
        assert_eq!(displacement(&ball), "by 0.50 m");
        let rod = ObjectTrack {
            round: false,
            ..ball
        };
        assert_eq!(displacement(&rod), "by 0.50 m and turned by 0°");
    }

    #[test]
    fn an_outline_turns_about_its_own_origin() {
        let corners = placed(&[[1.0, 0.0]], [2.0, 3.0, std::f64::consts::FRAC_PI_2]);
        assert!((corners[0][0] - 2.0).abs() < 1e-12 && (corners[0][1] - 4.0).abs() < 1e-12);
    }
}
