"""Fisher information of exploration episodes by central differences of whole trajectories, for a batch of episodes.

Every episode has copies with one unknown a little up and a little down, which go their own way under the same commands
(ASID, Memmel et al. 2024, equation 5: I = sum J^T S^-1 J). The noise S of a reading is the tracker's, plus what the copies
deviate from a straight line. An episode is rewarded for the increase of log det(I + 1), prior-scaled.
"""

import numpy as np

import rotation
from commander import Commander
from problem import SCALED_BOUND


class Episodes:
    """`n` episodes at once, each with `1 + 2 d` simulations."""

    def __init__(self, problem, interface, n):
        self.problem, self.n = problem, n
        self.d = len(problem.unknowns)
        self.copies = 1 + 2 * self.d
        self.simulations = interface(problem, n * self.copies)
        self.commander = Commander(problem, n)

    def begin(self, theta, starts):
        """Starts at unknowns (n x d) and start poses (n x coordinates); positions (n x nq)."""
        d, copies = self.d, self.copies
        all_theta = np.repeat(theta[:, None], copies, axis=1)
        self.step_size = np.empty((self.n, d))
        for i, unknown in enumerate(self.problem.unknowns):
            z = unknown.to_scaled(theta[:, i])
            up, down = (np.clip(z + s * self.problem.delta, -SCALED_BOUND, SCALED_BOUND) for s in (1.0, -1.0))
            all_theta[:, 1 + 2 * i, i] = unknown.from_scaled(up)
            all_theta[:, 2 + 2 * i, i] = unknown.from_scaled(down)
            self.step_size[:, i] = up - down
        qpos = self.problem.place(starts)
        self.simulations.begin(all_theta.reshape(-1, d), np.repeat(qpos, copies, axis=0))
        self.commander.reset()
        self.information = np.tile(np.eye(d), (self.n, 1, 1))
        self.log_det = np.zeros(self.n)
        return qpos

    def step(self, actions):
        """A control step with actions (n x entries, in the task's units): positions (n x nq) at its end, and rewards."""
        p = self.problem
        control = np.repeat(self.commander.commands(actions), self.copies, axis=0)
        qpos = self.simulations.step(control).reshape(self.n, self.copies, p.frames, -1)
        middle = qpos[:, 0]
        jacobian, noise = [], 1.0
        for i in range(self.d):
            up, down = qpos[:, 1 + 2 * i], qpos[:, 2 + 2 * i]
            jacobian.append(self._difference(up, down) / self.step_size[:, i, None, None])
            # up + down - 2 middle: nothing on a straight line, luck and curvature otherwise.
            noise = noise + (0.5 * (self._difference(up, middle) - self._difference(middle, down))) ** 2
        whitened = np.stack(jacobian, axis=-1) / np.sqrt(noise)[..., None]
        self.information += np.einsum("nfri,nfrj->nij", whitened, whitened)
        log_det = np.linalg.slogdet(self.information)[1]
        reward, self.log_det = log_det - self.log_det, log_det
        return middle[:, -1], reward

    def expected_std(self):
        """Expected posterior deviation of each unknown (n x d), prior-scaled."""
        return np.sqrt(np.einsum("nii->ni", np.linalg.inv(self.information)))

    def _difference(self, a, b):
        """Whitened difference of the tracked readings in positions (... x nq)."""
        parts = []
        for s in self.problem.signals:
            x, y = a[..., s.at : s.at + s.length], b[..., s.at : s.at + s.length]
            if s.length == 4:
                parts.append(rotation.to_vector(rotation.multiply(x, rotation.conjugate(y))) / s.noise)
            else:
                parts.append((x - y) / s.noise)
        return np.concatenate(parts, axis=-1)
