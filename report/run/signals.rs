//! Real readings against the same commands replayed before and after identification.

use super::trace::{Replay, RunReport, Signal};
use crate::number::{decimals, quantity, significant};
use crate::page::{Figure, Section};
use crate::plot::{Axis, Chart, Colour, Layer};

pub(super) fn section(report: &RunReport) -> Option<Section> {
    let section = Section::new("Real against replayed");
    if report.signals.is_empty() && !report.stage.is_empty() {
        return None;
    }
    if report.signals.is_empty() {
        return Some(section.note("No replay: the run kept no readings to compare with."));
    }
    let lead = "The commands of the real episode, replayed open-loop in the simulator: before with the prior's mean, \
                after with the estimate. What is left should look like noise.";
    Some(
        section
            .lead(lead)
            .figures(report.signals.iter().map(figure).collect()),
    )
}

fn figure(signal: &Signal) -> Figure {
    let title = format!(
        "{}, real and replayed",
        if signal.name.is_empty() {
            "A signal"
        } else {
            &signal.name
        }
    );
    Figure::new(title, chart(signal), caption(signal))
}

fn chart(signal: &Signal) -> Chart {
    let label = if signal.name.is_empty() {
        "reading"
    } else {
        &signal.name
    };
    let readings: Vec<[f64; 2]> = signal
        .time
        .iter()
        .zip(&signal.readings)
        .map(|(&t, &v)| [t, v])
        .collect();
    let mut chart = Chart::new(
        &format!("{label}: real and replayed"),
        Axis::new("time", "s"),
        Axis::new(label, &signal.unit),
    )
    .clock("", signal.time.first().copied().unwrap_or(0.0))
    .description(caption(signal));
    if let Some(after) = &signal.after {
        let band = after
            .time
            .iter()
            .zip(&after.band95)
            .map(|(&t, b)| [t, b[0], b[1]])
            .collect::<Vec<_>>();
        if !band.is_empty() {
            chart = chart.layer(Layer::band(band).colour(Colour::Blue));
        }
    }
    if let Some(before) = &signal.before {
        chart = chart.layer(
            Layer::line(line(before))
                .colour(Colour::Vermillion)
                .dashed()
                .label("before"),
        );
    }
    if let Some(after) = &signal.after {
        chart = chart.layer(Layer::line(line(after)).colour(Colour::Blue).label("after"));
    }
    if let Some(noise) = signal.noise_std.filter(|n| n.is_finite() && *n > 0.0) {
        let whiskers = readings
            .iter()
            .map(|&[t, v]| [t, v - 2.0 * noise, v + 2.0 * noise])
            .collect();
        chart = chart.layer(Layer::whiskers(whiskers).colour(Colour::Ink));
    }
    chart.layer(Layer::dots(readings).colour(Colour::Ink).label("real"))
}

fn line(replay: &Replay) -> Vec<[f64; 2]> {
    replay
        .time
        .iter()
        .zip(&replay.value)
        .map(|(&t, &v)| [t, v])
        .collect()
}

fn caption(signal: &Signal) -> String {
    let noise = signal.noise_std.filter(|n| n.is_finite() && *n > 0.0);
    let rms = |replay: &Option<Replay>| replay.as_ref().and_then(|r| residual(signal, r));
    let show = |rms: f64| match noise {
        Some(noise) => decimals(rms / noise, 1),
        None => quantity(&significant(rms, 2), &signal.unit),
    };
    let times = if noise.is_some() {
        " times the noise"
    } else {
        ""
    };
    let mut text = match (rms(&signal.before), rms(&signal.after)) {
        (Some(before), Some(after)) => format!(
            "Off by {}{times} before, by {} after (root mean square",
            show(before),
            show(after)
        ),
        (Some(one), None) | (None, Some(one)) => {
            format!("Off by {}{times} (root mean square", show(one))
        }
        (None, None) => return "Readings of the real episode.".to_owned(),
    };
    if let Some(noise) = noise {
        text.push_str(&format!(
            "; the noise is {}, strokes are ± two of it",
            quantity(&significant(noise, 2), &signal.unit)
        ));
    }
    text.push_str(").");
    text
}

/// Root mean square of reading minus replay, over the readings that the replay covers.
fn residual(signal: &Signal, replay: &Replay) -> Option<f64> {
    let squares: Vec<f64> = signal
        .time
        .iter()
        .zip(&signal.readings)
        .filter_map(|(&t, &reading)| Some((reading - interpolate(replay, t)?).powi(2)))
        .filter(|s| s.is_finite())
        .collect();
    (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}

fn interpolate(replay: &Replay, t: f64) -> Option<f64> {
    let count = replay.time.len().min(replay.value.len());
    let time = &replay.time[..count];
    let next = time.partition_point(|&x| x < t);
    match (next.checked_sub(1), time.get(next)) {
        (_, Some(&exact)) if exact == t => Some(replay.value[next]),
        (Some(before), Some(&after)) => {
            let share = (t - time[before]) / (after - time[before]);
            Some(replay.value[before] + share * (replay.value[next] - replay.value[before]))
        }
        // Clocks that differ only by rounding still meet at the end.
        (Some(last), None) if t - time[last] < 1e-6 => Some(replay.value[last]),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_residual_is_taken_between_replayed_points_and_skips_missing_readings() {
        let replay = Replay {
            time: vec![0.0, 1.0, 2.0],
            value: vec![0.0, 2.0, 4.0],
            band95: vec![],
        };
        let signal = Signal {
            time: vec![0.0, 0.5, 1.5, 9.0],
            readings: vec![3.0, f64::NAN, -1.0, 0.0],
            ..Signal::default()
        };
        // Residuals 3 at t = 0 and -4 at t = 1.5.
        assert!((residual(&signal, &replay).unwrap() - 12.5f64.sqrt()).abs() < 1e-12);
    }
}
