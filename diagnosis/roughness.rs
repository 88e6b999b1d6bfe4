//! What the simulator itself cannot repeat.
//!
//! Where contacts amplify the smallest difference, an open-loop rollout is one of many
//! that fit equally well, and its distance from the log is no fault of the model. An
//! ensemble of rollouts from starts that differ by next to nothing (or by what is not
//! known of the start) spans the directions in which predictions scatter; log and prediction
//! both do. Residuals are whitened with it ([whitening](crate::whitening)).

use asid_core::Result;
use asid_core::layout::Layout;
use nalgebra::{DMatrix, DVector};
use rand::Rng as _;

use crate::data::Logs;
use crate::predict::{Point, Predictor};
use crate::whitening::Scattering;

/// Rollouts of the ensemble.
const MEMBERS: usize = 12;
/// Log and prediction scatter alike, so a difference has twice the variance.
const BOTH: f64 = 2.0;

/// How far the members' starts are apart.
#[derive(Clone, Debug)]
pub enum Spread {
    /// Starts that are known: differences that no sensor sees (m, rad, and per second) in this
    /// many coordinates.
    Known(usize),
    /// Starts that are open in some coordinates: for each episode a root of their covariance.
    Open(Vec<usize>, Vec<DMatrix<f64>>),
}

/// Difference of starts that are known.
const UNSEEN: f64 = 1e-9;

impl Spread {
    /// Of a machine whose starts are known.
    #[must_use]
    pub fn of_known_starts(layout: &Layout) -> Self {
        Self::Known(2 * layout.nv)
    }

    /// That of some episodes. Windows of episodes, whose starts are fitted, come after them and
    /// count as known.
    pub(crate) fn of(&self, episodes: &[usize]) -> Self {
        match self {
            Self::Open(coordinates, roots) if episodes.iter().all(|&e| e < roots.len()) => {
                let own = episodes.iter().map(|&e| roots[e].clone());
                Self::Open(coordinates.clone(), own.collect())
            }
            Self::Open(coordinates, _) => Self::Known(coordinates.len()),
            Self::Known(n) => Self::Known(*n),
        }
    }

    /// Draws shifts of an episode's start: coordinates and by how much.
    fn draw(&self, episode: usize, rng: &mut asid_core::rng::Rng) -> Vec<(usize, f64)> {
        // Uniform with the deviation asked for.
        let mut draw = |by: f64| -> f64 { by * rng.random_range(-1.0..1.0) * 3.0_f64.sqrt() };
        match self {
            Self::Known(n) => (0..*n).map(|c| (c, draw(UNSEEN))).collect(),
            Self::Open(coordinates, roots) => {
                let unit = DVector::from_fn(coordinates.len(), |_, _| draw(1.0));
                let shift = &roots[episode] * unit;
                coordinates
                    .iter()
                    .copied()
                    .zip(shift.iter().copied())
                    .collect()
            }
        }
    }
}

/// Directions in which predictions scatter about a point, each as long as its deviation,
/// for each episode.
///
/// # Errors
/// As [`Predictor::residuals`].
pub fn estimate(
    predictor: &mut Predictor<'_>,
    layout: &Layout,
    point: &Point,
    spread: &Spread,
    rng: &mut asid_core::rng::Rng,
) -> Result<Vec<Vec<Vec<f64>>>> {
    let episodes = predictor.logs().episodes.len();
    let points: Vec<Point> = (0..MEMBERS)
        .map(|_| {
            let mut other = point.clone();
            for (e, start) in other.starts.iter_mut().enumerate().take(episodes) {
                for (coordinate, by) in spread.draw(e, rng) {
                    start.shift(layout, coordinate, by);
                }
            }
            other
        })
        .collect();
    predictor.set_scattering(Scattering::default());
    let members = predictor.residuals(&points)?;
    let logs = predictor.logs();
    Ok((0..logs.episodes.len())
        .map(|e| {
            let range = logs.offset(e)..logs.offset(e + 1);
            let finite: Vec<&[f64]> = members
                .iter()
                .map(|m| &m[range.clone()])
                .filter(|m| m.iter().all(|x| x.is_finite()))
                .collect();
            if finite.len() < 2 {
                return Vec::new();
            }
            let n = finite.len() as f64;
            let mean: Vec<f64> = (0..range.len())
                .map(|k| finite.iter().map(|m| m[k]).sum::<f64>() / n)
                .collect();
            let scale = (BOTH / (n - 1.0)).sqrt();
            let off = |m: &&[f64]| m.iter().zip(&mean).map(|(x, y)| scale * (x - y)).collect();
            finite.iter().map(off).collect()
        })
        .collect())
}

/// Deviation of an engine's clock in time steps. A step ends at one time, and an engine's
/// velocities are those of its start, its middle or its end, as its integrator has it.
const CLOCK: f64 = 0.5;

/// Directions in which a sensor of one episode moves if the engine reads it a part of a
/// `timestep` (s) early or late, in units of the noise, each as long as its deviation; one a
/// sensor. `readings` are the predicted ones, `rows x width`. A lag of the machine that is
/// finer than the step of its model cannot be told from this.
#[must_use]
pub fn clocks(logs: &Logs, episode: usize, readings: &[f64], timestep: f64) -> Vec<Vec<f64>> {
    let speeds = logs.speeds(episode, readings);
    if !speeds.iter().all(|x| x.is_finite()) {
        return Vec::new();
    }
    let present = &logs.present()[logs.offset(episode)..logs.offset(episode + 1)];
    let noise = logs.entry_noise();
    let n = noise.len();
    let of = |sensor: usize| {
        let shift = |(k, speed): (usize, &f64)| {
            let entry = k % n;
            let moves = present[k] && logs.entries[entry].sensor == sensor;
            if moves {
                CLOCK * timestep * speed / noise[entry]
            } else {
                0.0
            }
        };
        speeds.iter().enumerate().map(shift).collect()
    };
    (0..logs.sensors.len()).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::whitening::Whitening;

    #[test]
    fn open_starts_are_drawn_with_their_covariance() {
        // Place and speed of a short record trade off: a correlation of -0.9.
        let root = DMatrix::from_row_slice(2, 2, &[0.01, 0.0, -0.09, 0.0436]);
        let spread = Spread::Open(vec![0, 3], vec![DMatrix::zeros(2, 2), root.clone()]);
        let mut rng = asid_core::Streams::new(0).stream("test");
        let n = 20_000;
        let mut covariance = DMatrix::<f64>::zeros(2, 2);
        for _ in 0..n {
            let shifts = spread.draw(1, &mut rng);
            assert_eq!([shifts[0].0, shifts[1].0], [0, 3]);
            let v = DVector::from_vec(vec![shifts[0].1, shifts[1].1]);
            covariance += &v * v.transpose() / f64::from(n);
        }
        let expected = &root * root.transpose();
        // 20 000 draws tell a variance to 2 %.
        let error = (covariance - &expected).norm() / expected.norm();
        assert!(error < 0.04, "{error}");
    }

    #[test]
    fn a_lag_finer_than_the_time_step_is_no_gap() {
        use asid_core::Scene;
        use asid_mjcf::Plant;
        let scene = r#"<mujoco><option timestep="0.002"/><worldbody><body>
            <joint name="slide" type="slide"/><geom size="0.1" mass="1"/></body></worldbody>
            <sensor><jointpos name="place" joint="slide"/></sensor></mujoco>"#;
        let plant = Plant::of(&Scene::from_xml("slide", scene, &[]).unwrap()).unwrap();
        let wave = |t: f64| (3.0 * t).sin();
        let time: Vec<f64> = (0..200).map(|k| 0.02 * f64::from(k)).collect();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        let rows: String = time.iter().map(|t| format!("{t},{}\n", wave(*t))).collect();
        std::fs::write(&path, format!("time,place\n{rows}")).unwrap();
        let log = (
            "log".to_owned(),
            asid_logs::episode::read(&path, &plant.layout).unwrap(),
        );
        let mut logs = Logs::new(&plant, &["place".to_owned()], vec![log]).unwrap();
        logs.set_noise(&[1e-4]);
        let whitening = |lag: f64| {
            let late: Vec<f64> = time.iter().map(|t| wave(t - lag)).collect();
            let whitening = Whitening::of(&clocks(&logs, 0, &late, 0.002));
            let mut residuals = vec![0.0; logs.len()];
            logs.difference(0, &late, &mut residuals);
            residuals.iter_mut().for_each(|r| *r /= 1e-4);
            let square = |r: &[f64]| r.iter().map(|x| x * x).sum::<f64>();
            let before = square(&residuals);
            whitening.apply(&mut residuals);
            (before, square(&residuals))
        };
        // A lag of half a step is one deviation, ten steps are twenty.
        let (before, after) = whitening(0.001);
        assert!(before > 1000.0 && after < 2.0, "{before} {after}");
        let (_, after) = whitening(0.02);
        assert!(after > 300.0, "{after}");
    }
}
