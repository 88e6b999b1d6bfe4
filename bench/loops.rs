//! Selects the bare loop by the engine's name.

use anyhow::Result;
use asid_core::Scene;

use crate::bare::Bare;
use crate::rapier::Rapier;
use crate::workload::Workload;

/// The bare loop of an engine.
///
/// # Errors
/// If there is no loop for the engine, or if it refuses the scene.
pub fn bare<'a>(engine: &str, scene: &Scene, work: &'a Workload) -> Result<Box<dyn Bare + 'a>> {
    match engine {
        "rapier" => Ok(Box::new(Rapier::new(scene, work)?)),
        #[cfg(feature = "mujoco")]
        "mujoco" => Ok(Box::new(crate::mujoco::Mujoco::new(scene, work)?)),
        other => anyhow::bail!("no bare loop for engine `{other}`"),
    }
}

#[cfg(test)]
mod tests {
    use asid_core::registry::{BackendEntry, TaskEntry, all, find};
    use asid_core::{BatchConfig, Control, Rollout};

    use super::*;
    use crate::workload::Episodes;

    /// Speeds can be compared only if both sides do the same work.
    ///
    /// After two seconds of pushing, the arm must be where it is in a batch. A push that differs in
    /// the last digits moves it by less than a servo's play, 5 mrad.
    #[test]
    fn the_bare_loop_moves_the_arm_as_a_batch_does() {
        let task = (find::<TaskEntry>(crate::TASK).unwrap().make)().unwrap();
        let parameters = task.parameters();
        for entry in all::<BackendEntry>() {
            let model = (entry.make)().unwrap().load(task.scene()).unwrap();
            let episodes = Episodes::random(&*task, &parameters, 3, 1);
            let theta = &episodes.theta;
            let work =
                Workload::new(&*task, model.layout(), &parameters, &episodes, theta, 1).unwrap();
            let config = BatchConfig {
                size: work.sims,
                threads: 1,
                targets: work.targets.clone(),
            };
            let mut simulator = model.simulator(&config).unwrap();
            let sims: Vec<usize> = (0..work.sims).collect();
            simulator.set_parameters(&sims, &work.values).unwrap();
            simulator.set_state(&sims, &work.qpos, &work.qvel).unwrap();
            let joints: Vec<String> = (1..=7).map(|i| format!("qpos.joint{i}")).collect();
            let record = model.layout().recording(&joints).unwrap();
            let control = Control::PerSimulation(&work.control);
            let rollout = Rollout::new(&sims, work.frames, work.substeps, control, &record);
            let mut readings = vec![0.0; work.sims * work.frames * joints.len()];
            simulator.rollout(&rollout, &mut readings).unwrap();

            let mut loops = bare(entry.name, task.scene(), &work).unwrap();
            loops.rewind().unwrap();
            loops.run(2);
            for i in 0..work.sims {
                let row = work.row(&readings, i);
                let last = &row[row.len() - joints.len()..];
                for (a, b) in last.iter().zip(loops.qpos(i)) {
                    assert!((a - b).abs() < 5e-3, "{} {i}: {a} and {b}", entry.name);
                }
            }
        }
    }
}
