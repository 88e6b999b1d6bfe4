//! Variations of recorded commands: faster or slower, larger or smaller, mirrored.

use asid_core::{Episode, Layout};

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
    /// Returns an episode with varied commands, within their ranges, and with readings of zero.
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
        other.readings.fill(0.0);
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
}
