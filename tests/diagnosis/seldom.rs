//! A machine with contact in only some of its logs: a plunger above a floor, and a slide with
//! friction beside it.

use std::path::Path;

use super::played::Player;
use super::rows::{write_log, write_model};
use super::{has_contacts, run_on};

/// Rows of a log, time between them and time step, s.
const ROWS: usize = 80;
const ROW: f64 = 0.02;
const STEP: f64 = 0.001;
/// Standard deviation of a reading, m.
const NOISE: f64 = 1e-3;
/// Number of logs; the last is held out.
const EPISODES: usize = 8;
/// Height from which the plunger falls in each log, m. In every third training log it begins so far
/// above the floor that it touches nothing.
const HEIGHT: [f64; EPISODES] = [0.3, 30.0, 0.35, 0.4, 30.0, 0.45, 0.5, 0.38];

/// Both slides; the second has the viscous friction `damping`, N s/m.
fn scene(damping: f64) -> String {
    format!(
        r#"<mujoco model="plunger"><option timestep="{STEP}"/><worldbody>
        <geom name="floor" type="plane" size="9 9 0.1" solref="-4000 -9"/>
        <body name="plunger"><joint name="fall" type="slide" axis="0 0 1"/>
          <geom name="plunger" type="sphere" size="0.05" mass="0.1" solref="-4000 -9"/></body>
        <body name="cart" pos="3 0 2"><joint name="rail" type="slide" axis="1 0 0" damping="{damping}"/>
          <geom name="cart" type="box" size="0.1 0.1 0.1" mass="1"/></body>
        </worldbody><sensor><jointpos name="z" joint="fall"/><jointpos name="x" joint="rail"/></sensor></mujoco>"#
    )
}

fn write_study(folder: &Path, damping: f64) {
    let mut player = Player::of(&scene(damping), &["z", "x"], [ROW, STEP]);
    for (episode, height) in HEIGHT.into_iter().enumerate() {
        let start = [height, 0.0, 0.0, 1.0 + 0.2 * episode as f64];
        let places = player.play(start.split_at(2), &[], ROWS);
        let columns = ",z,x,qpos.fall,qpos.rail,qvel.fall,qvel.rail";
        let place = (episode, EPISODES);
        write_log(folder, place, columns, (&places, 2), &start, (ROW, NOISE));
    }
    write_model(folder, &scene(0.0));
}

/// The screening first uses every third log, and these have no contact.
///
/// Guards against columns of both slides separated by force derivatives that only these logs have.
/// The mismatch with the other logs caused a panic.
#[test]
fn a_part_of_the_logs_without_contact_is_walked_as_the_others_are() {
    if !has_contacts() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path(), 0.5);
    let result = run_on(folder.path(), &[]).0.result;
    // Drag on the cart has the same effect.
    let names = ["viscous-friction@rail", "linear-drag@cart"];
    assert!(
        names.contains(&&*result.verdict.effects[0]),
        "{}",
        result.sentence
    );
    assert!(
        result.gap.refined < 0.1 * result.gap.identified,
        "{:?}",
        result.gap
    );
}
