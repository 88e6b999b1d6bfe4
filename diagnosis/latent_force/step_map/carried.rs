//! Derivatives over a row, extended from one of its physics steps to all of them.
//!
//! Let `a` be the derivative of a step with respect to the state, and `b` that with respect to a
//! value of the model. The derivatives of `n` steps are `a^n` and `(I + a + … + a^(n-1)) b`. They
//! are right to second order in the row's duration, because they are taken in its middle. The
//! result of a fit hardly depends on them, only its speed does.

use nalgebra::{DMatrix, DVector};

use crate::latent_force::tangent::difference;

use super::pass::{Part, STATE_STEP};
use super::role::Role;
use super::step::{RowBuffers, Stepped};
use super::{Common, LinearEpisode, Request};

/// Largest factor by which a step may multiply a change of a coordinate.
///
/// A step is short beside the time constants of the machine, or its integrator fails. A change that
/// grows by half within one step is a jump between two branches of a law, as where a joint comes to
/// a stop. Its power does not describe the row.
const MOST_GROWTH: f64 = 1.5;

impl Part {
    /// Returns the places of the roles whose derivatives one physics step gives, and of the others.
    ///
    /// The first are coordinates of the state, if all of them are present, because the power of a
    /// matrix needs all of it. They also include variations that act in every step alike, if their
    /// changes can be extended to the row.
    pub(super) fn told_by_one_step(
        &self,
        c: &Common<'_>,
        stepped: Stepped<'_>,
        request: Request<'_>,
        out: &[LinearEpisode],
    ) -> (Vec<usize>, Vec<usize>) {
        let Stepped { roles, now, .. } = stepped;
        let states = roles.iter().filter(|r| r.slot().is_some()).count();
        let all_states = states == 2 * c.islands.slots();
        let carried = |e: &usize| !self.carried(*e, request, out).is_empty();
        let carries = all_states || now.iter().all(carried);
        let stepped = (0..roles.len()).filter(|&v| !request.is_read_alone(roles[v]));
        stepped.partition(|&v| match roles[v] {
            Role::State(_) => all_states,
            Role::Varied(i) => carries && request.at_once[i],
            _ => false,
        })
    }

    /// Returns [`LinearEpisode::carried`] of a walk, fresh or kept; empty where it is unknown.
    fn carried<'r>(
        &self,
        walk: usize,
        request: Request<'r>,
        out: &'r [LinearEpisode],
    ) -> &'r [f64] {
        let fresh = &out[walk].carried[..];
        let kept = request.anew.carried.get(self.walks[walk]);
        if fresh.is_empty() {
            kept.map_or(&[], |k| &k[..])
        } else {
            fresh
        }
    }

    /// Extends derivatives to a row from one of its physics steps, which the roles `all` have just
    /// taken.
    ///
    /// Where that step jumps, it uses the derivatives of the row before.
    pub(super) fn carry_over(
        &self,
        c: &Common<'_>,
        (stepped, all, short): (Stepped<'_>, &[usize], &[usize]),
        request: Request<'_>,
        row: &mut RowBuffers,
        out: &mut [LinearEpisode],
    ) {
        let Stepped {
            roles,
            now,
            k,
            substeps,
        } = stepped;
        let (nx, width) = (2 * c.layout.nv, c.layout.nq + c.layout.nv);
        let m = request.variations.len();
        let at = k * nx * nx..(k + 1) * nx * nx;
        let mut differ = vec![0.0; nx];
        for (i, &e) in now.iter().enumerate() {
            let nominal = row.state(i, width);
            let mut of_step = DMatrix::zeros(nx, nx);
            let mut varied = Vec::new();
            let mut states = false;
            for (place, &v) in all.iter().enumerate().filter(|(_, v)| short.contains(v)) {
                let other = row.state(place * now.len() + i, width);
                difference(&c.layout, other, nominal, &mut differ);
                let scale = match roles[v] {
                    Role::Varied(i) => request.variations[i].scale,
                    _ => STATE_STEP,
                };
                let slope = differ.iter().map(|d| d / scale);
                let slope = slope.map(|s| if s.is_finite() { s } else { 0.0 });
                match roles[v] {
                    Role::Varied(i) => varied.push((i, DVector::from_iterator(nx, slope))),
                    Role::State(slot) => {
                        states = true;
                        for (s, slope) in slope.enumerate() {
                            if let Some(coordinate) = c.islands.coordinate_told(slot, s) {
                                of_step[(s, coordinate)] = slope;
                            }
                        }
                    }
                    _ => {}
                }
            }
            if states {
                if jumps(&of_step) {
                    of_step = row
                        .of_step
                        .get(&e)
                        .map_or_else(|| DMatrix::identity(nx, nx), DMatrix::clone);
                }
                let (whole, carried) = powers(&of_step, substeps);
                let steps = out[e].rows - 1;
                out[e].carried.resize(steps * nx * nx, 0.0);
                // Row-major, which is the storage order of the transpose.
                out[e].a[at.clone()].copy_from_slice(whole.transpose().as_slice());
                out[e].carried[at.clone()].copy_from_slice(carried.transpose().as_slice());
                row.of_step.insert(e, of_step);
            }
            if varied.is_empty() {
                continue;
            }
            let carried = &self.carried(e, request, out)[at.clone()];
            let carried = DMatrix::from_row_slice(nx, nx, carried);
            for (i, slope) in varied {
                let column = &carried * slope;
                for (s, value) in column.iter().enumerate() {
                    out[e].state_columns[(k * nx + s) * m + i] = *value;
                }
            }
        }
    }
}

/// Whether the derivative of one step is that of a jump, or not a number.
fn jumps(of_step: &DMatrix<f64>) -> bool {
    !of_step.diagonal().iter().all(|g| g.abs() <= MOST_GROWTH)
}

/// Returns the power `A^n` of a matrix, and the sum `I + A + … + A^(n-1)` of its lower powers, by
/// doubling.
fn powers(a: &DMatrix<f64>, n: usize) -> (DMatrix<f64>, DMatrix<f64>) {
    let size = a.nrows();
    let (mut power, mut sum) = (DMatrix::identity(size, size), DMatrix::zeros(size, size));
    for bit in (0..usize::BITS - n.leading_zeros()).rev() {
        sum += &power * &sum;
        power = &power * &power;
        if n >> bit & 1 == 1 {
            sum = a * sum + DMatrix::identity(size, size);
            power = a * power;
        }
    }
    (power, sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_joint_that_stops_within_a_step_is_a_jump() {
        let smooth = DMatrix::from_row_slice(2, 2, &[1.0, 1e-3, -30.0, 0.97]);
        assert!(!jumps(&smooth));
        // Friction that changes its branch between two speeds 1e-6 apart.
        let stops = DMatrix::from_row_slice(2, 2, &[1.0, 1e-3, -30.0, -181.0]);
        assert!(jumps(&stops));
        assert!(jumps(&DMatrix::from_element(2, 2, f64::NAN)));
    }

    #[test]
    fn powers_are_products_and_their_sum_is_a_geometric_series() {
        let a = DMatrix::from_row_slice(2, 2, &[0.9, 0.1, -0.3, 0.8]);
        for n in [1, 2, 7, 10, 20] {
            let (power, sum) = powers(&a, n);
            let by_hand = (0..n).fold(DMatrix::identity(2, 2), |p, _| &a * p);
            assert!((&power - by_hand).amax() < 1e-14);
            // (A - I) (I + A + ... + A^(n-1)) = A^n - I
            let identity = DMatrix::identity(2, 2);
            let left = (&a - &identity) * sum;
            assert!((left - (power - identity)).amax() < 1e-13, "{n}");
        }
    }
}
