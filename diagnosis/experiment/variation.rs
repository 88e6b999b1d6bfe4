//! Variations of recorded commands: faster or slower, larger or smaller, mirrored.

use asid_core::signal::orientation;
use asid_core::{Episode, Layout};

/// The orientation that turns nothing, `w x y z`.
const UPRIGHT: [f64; 4] = [1.0, 0.0, 0.0, 0.0];

/// A factor on the size of the commands about their mean, and one on time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Variation {
    size: f64,
    stretch: f64,
}

const fn variation(size: f64, stretch: f64) -> Variation {
    Variation { size, stretch }
}

/// Variations that are tried; the first leaves the commands as recorded.
pub(super) const VARIATIONS: [Variation; 6] = [
    variation(1.0, 1.0),
    variation(0.4, 1.0),
    variation(1.5, 1.0),
    variation(1.0, 0.5),
    variation(1.0, 2.0),
    variation(-1.0, 1.0),
];

impl Variation {
    /// Returns an episode with varied commands, within their ranges, and with the same reading in
    /// each row: predictions of it are compared with each other, and any reading will do.
    ///
    /// Numbers are zero. An orientation is the first that the log reads: from one on the other side
    /// of a body, two predictions next to each other would differ by a whole turn.
    pub(super) fn of(self, episode: &Episode, layout: &Layout) -> Episode {
        let nu = episode.actuators.len();
        let mut other = episode.clone();
        let start = other.time[0];
        for t in &mut other.time {
            *t = start + (*t - start) * self.stretch;
        }
        for a in 0..nu {
            let column = || episode.ctrl.iter().skip(a).step_by(nu);
            let n = column().count().max(1) as f64;
            let mean = column().sum::<f64>() / n;
            let range = layout.actuators[a].ctrl_range;
            for (k, u) in column().enumerate() {
                let x = mean + self.size * (u - mean);
                other.ctrl[k * nu + a] = range.map_or(x, |[low, high]| x.clamp(low, high));
            }
        }
        let width = other.width();
        let mut constant = Vec::with_capacity(width);
        for channel in &episode.channels {
            let columns = constant.len()..constant.len() + channel.len;
            let sensor = layout.sensor(&channel.name);
            if sensor.is_ok_and(|s| s.is_orientation()) {
                let rows = episode.readings.chunks_exact(width);
                let mut turns = rows.filter_map(|row| orientation(&row[columns.clone()]));
                let first = turns.next().map_or(UPRIGHT, |q| [q.w, q.i, q.j, q.k]);
                constant.extend(first);
            } else {
                constant.resize(columns.end, 0.0);
            }
        }
        for row in other.readings.chunks_exact_mut(width.max(1)) {
            row.copy_from_slice(&constant);
        }
        other
    }

    /// Describes the variation in words that follow a log's name; empty for none.
    pub(super) fn words(self) -> String {
        let size = match self.size {
            s if s < 0.0 => " with the commands mirrored about their mean".to_owned(),
            s if s != 1.0 => format!(" with commands {s} times as large about their mean"),
            _ => String::new(),
        };
        let speed = match self.stretch {
            s if s < 1.0 => " at twice the speed",
            s if s > 1.0 => " at half the speed",
            _ => "",
        };
        size + speed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Scene;
    use asid_core::episode::ChannelColumns;
    use asid_core::signal::rotation_difference;
    use asid_mjcf::Plant;

    #[test]
    fn commands_are_scaled_about_their_mean_and_kept_in_their_range() {
        let scene = r#"<mujoco><worldbody><body><joint name="j" axis="1 0 0"/><geom size="0.1" mass="1"/></body></worldbody>
            <actuator><motor name="m" joint="j" ctrlrange="-1 2"/></actuator></mujoco>"#;
        let scene = Scene::from_xml("scene", scene, &[]).expect("a scene");
        let layout = Plant::of(&scene).expect("a machine").layout;
        let episode = Episode {
            time: vec![1.0, 1.1, 1.3],
            actuators: vec!["m".into()],
            ctrl: vec![0.0, 0.0, 1.5],
            ..Episode::default()
        };
        let faster = variation(1.5, 0.5).of(&episode, &layout);
        assert_eq!(faster.ctrl, [-0.25, -0.25, 2.0]);
        let expected = [1.0, 1.05, 1.15];
        let pairs = faster.time.iter().zip(expected);
        assert!(pairs.into_iter().all(|(t, e)| (t - e).abs() < 1e-12));
        assert_eq!(variation(1.0, 1.0).of(&episode, &layout), episode);
    }

    /// Symptom: no orientation told two explanations apart, however differently a body turned.
    /// Cause: the varied episode read zeros, which are no orientation, so that its rows counted as
    /// missing.
    #[test]
    fn orientations_of_a_varied_episode_differ_from_predictions() {
        let scene = r#"<mujoco><worldbody><body name="b"><freejoint/><geom size="0.1"/></body></worldbody>
            <sensor><framepos name="place" objtype="xbody" objname="b"/>
            <framequat name="turn" objtype="xbody" objname="b"/></sensor></mujoco>"#;
        let scene = Scene::from_xml("scene", scene, &[]).expect("a scene");
        let layout = Plant::of(&scene).expect("a machine").layout;
        let channel = |(name, len): (&str, usize)| ChannelColumns {
            name: name.into(),
            len,
        };
        let lost = [0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 0.0];
        let read = [0.4, 0.5, 0.6, 0.0, 0.6, 0.8, 0.0];
        let mut episode = Episode {
            time: vec![0.0, 0.1],
            channels: [("place", 3), ("turn", 4)].map(channel).into(),
            readings: [lost, read].concat(),
            ..Episode::default()
        };
        let row = [0.0, 0.0, 0.0, 0.0, 0.6, 0.8, 0.0];
        let varied = VARIATIONS[1].of(&episode, &layout);
        assert_eq!(varied.readings, row.repeat(2));
        // A log without one reading of it gives none to compare with.
        episode.readings = lost.repeat(2);
        let varied = VARIATIONS[1].of(&episode, &layout);
        assert_eq!(varied.reading(1)[3..], UPRIGHT);
        // A quarter turn about z away from it.
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let turned = rotation_difference(&[half, 0.0, 0.0, half], &varied.reading(0)[3..]);
        assert!(
            (turned[2] - std::f64::consts::FRAC_PI_2).abs() < 1e-12,
            "{turned:?}"
        );
    }
}
