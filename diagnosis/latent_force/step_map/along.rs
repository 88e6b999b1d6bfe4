//! Derivatives along segments: each simulation is placed at the first row and runs on by itself.

use asid_core::{Result, Simulator as _};

use crate::latent_force::tangent::difference;
use crate::latent_force::walk::Walk;

use super::leg::legs;
use super::pass::Part;
use super::role::Role;
use super::step::RowBuffers;
use super::{Common, LinearEpisode, Request};

/// Most rows in one rollout.
///
/// A pass of a thousand simulations with thirty numbers a row takes 15 MB then.
const ROWS: usize = 64;

impl Part {
    /// Replays some of its segments, unperturbed and in some roles.
    ///
    /// Takes the defects, the residuals, and the differences of the readings at all rows.
    pub(super) fn replay_stepped(
        &mut self,
        c: &Common<'_>,
        request: Request<'_>,
        (extra, which): (&[Role], &[bool]),
        out: &mut [LinearEpisode],
    ) -> Result<()> {
        let mut row = RowBuffers::default();
        let (roles, here) = self.begin(c, request, (extra, which), &mut row)?;
        let n = self.walks.len();
        let walks: Vec<&Walk> = self.walks.iter().map(|&w| &c.walks[w]).collect();
        let of_role = |v: usize| here.iter().map(move |e| v * n + e);
        let sims: Vec<usize> = (0..roles.len()).flat_map(of_role).collect();
        let width = c.readings.width();
        let mut read = vec![0.0; sims.len() * width];
        self.simulator.read(&sims, &c.readings, &mut read)?;
        for (i, &e) in here.iter().enumerate() {
            let reading = |v: usize| &read[(v * here.len() + i) * width..][..width];
            read_in_roles(c, request, (walks[e], &roles, 0), reading, &mut out[e]);
        }
        let (state, nx) = (c.layout.nq + c.layout.nv, 2 * c.layout.nv);
        let width = c.states_and_readings.width();
        let (mut reached, mut rolled) = (vec![0; n], Vec::new());
        loop {
            let next = legs(&walks, (&here, &reached), ROWS);
            if next.is_empty() {
                return Ok(());
            }
            for leg in next {
                self.roll_on(c, (&leg, roles.len()), &mut rolled)?;
                for (i, &e) in leg.walks.iter().enumerate() {
                    reached[e] += leg.rows;
                    for f in 0..leg.rows {
                        let at = |v: usize| (v * leg.walks.len() + i) * leg.rows + f;
                        let row = |v: usize| &rolled[at(v) * width..(at(v) + 1) * width];
                        let k = leg.from + f;
                        let ahead = &request.trajectory[self.walks[e]][(k + 1) * state..];
                        let defect = &mut out[e].defect[k * nx..(k + 1) * nx];
                        difference(&c.layout, &row(0)[..state], &ahead[..state], defect);
                        let reading = |v: usize| &row(v)[state..];
                        read_in_roles(c, request, (walks[e], &roles, k + 1), reading, &mut out[e]);
                    }
                }
            }
        }
    }
}

/// Writes the residuals of row `k` of a segment, and the differences of its readings in all roles;
/// zero where one is not finite.
fn read_in_roles<'r>(
    c: &Common<'_>,
    request: Request<'_>,
    (walk, roles, k): (&Walk, &[Role], usize),
    reading: impl Fn(usize) -> &'r [f64],
    out: &mut LinearEpisode,
) {
    let (ns, nx, m) = (
        c.logs.entries.len(),
        2 * c.layout.nv,
        request.variations.len(),
    );
    c.residual(
        (walk, k),
        reading(0),
        &mut out.residual[k * ns..(k + 1) * ns],
    );
    let mut differ = vec![0.0; ns];
    for (v, role) in roles.iter().enumerate().skip(1) {
        let (columns, width, i, step) = match *role {
            Role::State(i) => (&mut out.h, nx, i, request.push[i]),
            Role::Varied(i) => (&mut out.reading_columns, m, i, request.variations[i].scale),
            _ => continue,
        };
        c.logs
            .reading_difference(reading(v), reading(0), &mut differ);
        for (s, d) in differ.iter().enumerate() {
            let value = d / step;
            columns[(k * ns + s) * width + i] = if value.is_finite() { value } else { 0.0 };
        }
    }
}
