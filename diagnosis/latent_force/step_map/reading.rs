//! Readings at a row, and their derivatives.

use asid_core::{Result, Simulator as _};

use super::pass::{Part, STATE_STEP};
use super::role::Role;
use super::step::RowBuffers;
use super::{Common, LinearEpisode, Request};

impl Part {
    /// Returns the places of the roles that are read at row `k`.
    ///
    /// A derivative with respect to a force concerns the next state alone.
    fn read_at(c: &Common<'_>, roles: &[Role], k: usize, request: Request<'_>) -> Vec<usize> {
        let is_read = |&v: &usize| match roles[v] {
            Role::Nominal | Role::Reading(_) | Role::Ramp(_) => true,
            Role::Force(_) | Role::Jolt(_) => false,
            Role::State(_) => k == 0 || !c.sensors.read_the_state || c.sensors.change,
            Role::Varied(i) => request.read[i],
        };
        (0..roles.len()).filter(is_read).collect()
    }

    /// Reads the sensors at row `k`.
    pub(super) fn read_row(
        &mut self,
        c: &Common<'_>,
        roles: &[Role],
        (here, k): (&[usize], usize),
        request: Request<'_>,
        (out, ramps): (&mut [LinearEpisode], &mut [Vec<f64>]),
        row: &mut RowBuffers,
    ) -> Result<()> {
        let variations = request.variations;
        let (n, ns, nx) = (self.walks.len(), c.logs.entries.len(), 2 * c.layout.nv);
        let read = Self::read_at(c, roles, k, request);
        row.sims.clear();
        for v in &read {
            row.sims.extend(here.iter().map(|e| v * n + e));
        }
        let width = c.readings.width();
        row.read.resize(row.sims.len() * width, 0.0);
        self.simulator.read(&row.sims, &c.readings, &mut row.read)?;
        let m = variations.len();
        let mut differ = vec![0.0; ns];
        for (i, &e) in here.iter().enumerate() {
            let nominal = &row.read[i * width..(i + 1) * width];
            let walk = &c.walks[self.walks[e]];
            let residual = &mut out[e].residual[k * ns..(k + 1) * ns];
            c.residual((walk, k), nominal, residual);
            for (v, role) in roles.iter().enumerate().skip(1) {
                let Ok(at) = read.binary_search(&v) else {
                    if let Role::State(slot) = *role {
                        // The derivatives of coordinates that are read directly.
                        for i in c.islands.moved(slot) {
                            for s in 0..ns {
                                out[e].h[(k * ns + s) * nx + i] = out[e].h[s * nx + i];
                            }
                        }
                    }
                    continue;
                };
                let place = at * here.len() + i;
                let other = &row.read[place * width..(place + 1) * width];
                c.logs.reading_difference(other, nominal, &mut differ);
                match *role {
                    Role::State(slot) if !c.remembers_readings => {
                        for (s, d) in differ.iter().enumerate() {
                            if let Some(i) = c.islands.coordinate_read(slot, s) {
                                out[e].h[(k * ns + s) * nx + i] = d / STATE_STEP;
                            }
                        }
                    }
                    Role::Reading(i) => {
                        let time = walk.time[k];
                        for (s, d) in differ.iter().enumerate() {
                            let row = &mut out[e].h[(k * ns + s) * nx..(k * ns + s + 1) * nx];
                            let place = i.checked_sub(nx / 2).map_or(0.0, |place| row[place]);
                            row[i] = d / STATE_STEP - time * place;
                        }
                    }
                    Role::Ramp(i) => {
                        for (s, d) in differ.iter().enumerate() {
                            ramps[e][(k * ns + s) * (nx / 2) + i] = d / STATE_STEP;
                        }
                    }
                    Role::Varied(i) => {
                        for (s, d) in differ.iter().enumerate() {
                            let value = d / variations[i].scale;
                            out[e].reading_columns[(k * ns + s) * m + i] =
                                if value.is_finite() { value } else { 0.0 };
                        }
                    }
                    _ => {}
                }
            }
        }
        Ok(())
    }
}
