//! Columns that share one simulation and are separated afterwards.
//!
//! Friction at each of ten joints is ten columns, but one simulation can contain all ten. The
//! change of the speeds over a row, with the derivatives with respect to forces, shows which joint
//! each part came from. So the engine runs once for all columns whose effects reach different
//! joints or different sensors. This is the grouping of Curtis, Powell and Reid (1974) for sparse
//! Jacobians, with force as the space in which the matrix is sparse.

use asid_effects::Reach;
use nalgebra::DVector;

use crate::latent_force::context::Context;
use crate::latent_force::islands::Islands;

use super::force_response::Row;
use super::group::Group;

/// Fraction of a group's total, by magnitude, that may appear where no member reaches.
///
/// With more, a member reaches further than it declares. Differences are right to a thousandth of
/// it.
const ELSEWHERE: f64 = 0.01;

/// Change of a reading that counts as none, in standard deviations of its noise: the computed
/// rotation between two equal orientations is 1e-17 rad.
const NO_CHANGE: f64 = 1e-6;
/// Change of a state coordinate that counts as none, relative to its largest value, for the same
/// reason.
const NO_MOTION: f64 = 1e-12;

/// The entries of a row of readings.
pub(super) struct Entries {
    /// Sensor of each entry, by index in the layout.
    pub(super) sensors: Vec<usize>,
    /// Smallest change of each entry that counts, in its unit.
    least: Vec<f64>,
}

impl Entries {
    /// Returns the entries of the logs that are compared.
    pub(super) fn of(context: &Context<'_>) -> Self {
        let noise = context.logs.entry_noise();
        Self {
            // A sensor that the layout lacks is not the sensor of any effect.
            sensors: context.entry_sensors(),
            least: noise.iter().map(|n| NO_CHANGE * n).collect(),
        }
    }
}

/// Bookkeeping of how the changes of a group separate.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Account {
    /// Sum of squares of the whole change, as forces or in units of the coordinates, and of the
    /// part where no member reaches.
    parts: [f64; 2],
    /// Whether a change appeared that no member can have made.
    strange: bool,
}

impl Account {
    /// Whether the members reach what they declare and nothing else.
    pub(super) fn balances(&self) -> bool {
        !self.strange && self.parts[1] <= ELSEWHERE.powi(2) * self.parts[0]
    }

    /// Records the change of the state (`nx`) by effects that do not reach it; `scale` is the
    /// largest value of each coordinate.
    pub(super) fn still(&mut self, change: &[f64], scale: &[f64]) {
        let mut each = change.iter().zip(scale);
        self.strange |= each.any(|(x, s)| x.abs() > NO_MOTION * s);
    }

    /// Separates the change of the state over a row (`nx`, positions before speeds) by the forces
    /// behind it.
    ///
    /// `set` receives each member's place in the group and its part.
    pub(super) fn states(
        &mut self,
        group: &Group,
        row: &Row,
        change: &[f64],
        mut set: impl FnMut(usize, &[f64]),
    ) {
        if change.iter().all(|x| *x == 0.0) {
            return;
        }
        let (nx, n) = row.response.shape();
        let nv = nx / 2;
        let told = DVector::from_column_slice(&change[nx - n..]);
        let Some(forces) = row.factors.solve(&told) else {
            self.strange = true;
            return;
        };
        let mut reached = vec![false; nv];
        let mut part = vec![0.0; 2 * nv];
        for (i, reach) in group.reaches.iter().enumerate() {
            let Reach::Dofs(dofs) = reach else { continue };
            part.fill(0.0);
            for &d in dofs {
                reached[d] = true;
                for place in (d..n).step_by(nv) {
                    let response = row.response.column(place);
                    let own = part.iter_mut().zip(response.iter());
                    own.for_each(|(p, s)| *p += s * forces[place]);
                }
            }
            set(i, &part);
        }
        for (d, reached) in reached.iter().enumerate() {
            let square: f64 = (d..n).step_by(nv).map(|p| forces[p].powi(2)).sum();
            self.parts[0] += square;
            if !reached {
                self.parts[1] += square;
            }
        }
    }

    /// Separates the change of the state over a row (`nx`) by the island that each member reaches.
    ///
    /// `scale` is the largest value of each coordinate. `set` receives each member's place in the
    /// group and its part.
    pub(super) fn by_islands(
        &mut self,
        (own, islands): (&[usize], &Islands),
        (change, scale): (&[f64], &[f64]),
        mut set: impl FnMut(usize, &[f64]),
    ) {
        let nv = change.len() / 2;
        let of = |at: usize| islands.island(at % nv);
        let all = change.iter().enumerate();
        for ((at, x), scale) in all.clone().zip(scale).filter(|(_, scale)| **scale > 0.0) {
            let square = (x / scale).powi(2);
            self.parts[0] += square;
            if !own.contains(&of(at)) {
                self.parts[1] += square;
            }
        }
        let mut part = vec![0.0; change.len()];
        for (i, island) in own.iter().enumerate() {
            for (at, x) in all.clone() {
                part[at] = if of(at) == *island { *x } else { 0.0 };
            }
            set(i, &part);
        }
    }

    /// Separates the change of the readings of a row by sensor.
    ///
    /// `set` receives the member's place in the group, the entry and its change.
    pub(super) fn readings(
        &mut self,
        group: &Group,
        entries: &Entries,
        change: &[f64],
        mut set: impl FnMut(usize, usize, f64),
    ) {
        let each = entries.sensors.iter().zip(&entries.least).zip(change);
        for (entry, ((sensor, least), x)) in each.enumerate() {
            let is_own = |r: &Reach| *r == Reach::Sensor(*sensor);
            match group.reaches.iter().position(is_own) {
                Some(i) => set(i, entry, *x),
                None => self.strange |= x.abs() > *least,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::force_response::ForceSlopes;
    use super::super::group::grouped;
    use super::super::group::tests::dofs;
    use super::*;

    /// Two coupled joints, as in an arm: a force at one moves both.
    fn coupled() -> Row {
        let inverse = [1.0, -0.4, -0.4, 2.0];
        let by = |place: f64, speed: f64| -> Vec<f64> {
            let places = inverse.iter().map(|x| place * x);
            places.chain(inverse.iter().map(|x| speed * x)).collect()
        };
        // Held over 0.02 s, and in the first of ten steps.
        let (held, jolt) = (by(2e-4, 0.02), by(3.8e-5, 0.002));
        Row::of(&ForceSlopes { held, jolt }, 2, 10)
    }

    #[test]
    fn a_change_is_taken_apart_into_what_each_joint_made() {
        // 3 N m at the first joint early in the row, -2 N m at the second throughout it.
        let first = [1.14e-4, -4.56e-5, 0.006, -0.0024];
        let second = [1.6e-4, -8e-4, 0.016, -0.08];
        let both: Vec<f64> = first.iter().zip(&second).map(|(a, b)| a + b).collect();
        let group = &grouped([(7, dofs(&[0])), (9, dofs(&[1]))].into_iter())[0];
        let mut account = Account::default();
        let mut parts = Vec::new();
        account.states(group, &coupled(), &both, |i, part| {
            parts.push((i, part.to_vec()));
        });
        for (want, (i, part)) in [first, second].iter().zip(&parts) {
            for (a, b) in want.iter().zip(part) {
                assert!((a - b).abs() < 1e-12, "{i}: {part:?}");
            }
        }
        assert!(account.balances());
    }

    #[test]
    fn over_a_single_physics_step_the_speeds_say_it_all() {
        let held = vec![2e-6, -8e-7, -8e-7, 4e-6, 0.002, -0.0008, -0.0008, 0.004];
        let jolt = held.clone();
        let row = Row::of(&ForceSlopes { held, jolt }, 2, 1);
        // 3 N m at the first joint, -2 N m at the second.
        let (first, second) = (
            [6e-6, -2.4e-6, 0.006, -0.0024],
            [1.6e-6, -8e-6, 0.0016, -0.008],
        );
        let both: Vec<f64> = first.iter().zip(&second).map(|(a, b)| a + b).collect();
        let group = &grouped([(0, dofs(&[0])), (1, dofs(&[1]))].into_iter())[0];
        let mut account = Account::default();
        account.states(group, &row, &both, |i, part| {
            let want = [first, second][i];
            for (a, b) in want.iter().zip(part) {
                assert!((a - b).abs() < 1e-15, "{i}: {part:?}");
            }
        });
        assert!(account.balances());
    }

    #[test]
    fn a_force_where_no_member_reaches_is_noticed() {
        let group = Group::single(0, dofs(&[0]));
        let account = |second: f64| {
            let mut account = Account::default();
            let speeds = [1.0 - 0.4 * second, -0.4 + 2.0 * second];
            let change = [0.01 * speeds[0], 0.01 * speeds[1], speeds[0], speeds[1]];
            account.states(&group, &coupled(), &change, |_, _| {});
            account
        };
        assert!(account(0.0).balances() && account(0.001).balances());
        assert!(!account(0.1).balances());
    }

    #[test]
    fn a_reading_that_no_member_makes_is_noticed() {
        let group = &grouped([(0, Reach::Sensor(0)), (1, Reach::Sensor(2))].into_iter())[0];
        let entries = Entries {
            sensors: vec![0, 0, 1, 2],
            least: vec![1e-9; 4],
        };
        let mut found = Vec::new();
        let mut account = Account::default();
        account.readings(group, &entries, &[0.1, 0.2, 1e-17, 0.3], |i, entry, x| {
            found.push((i, entry, x));
        });
        assert_eq!(found, [(0, 0, 0.1), (0, 1, 0.2), (1, 3, 0.3)]);
        assert!(account.balances());
        account.readings(group, &entries, &[0.0, 0.0, 0.1, 0.0], |_, _, _| {});
        assert!(!account.balances());
    }
}
