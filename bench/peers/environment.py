"""Fisher exploration as a vectorised environment of Stable-Baselines3, with ASID's observations.

An observation is a noisy reading (an orientation as two columns of its matrix, the hand also seen from the object), the
share of the episode that is over, and the information gathered so far.
"""

import gymnasium
import numpy as np
from stable_baselines3.common.vec_env import VecEnv

import rotation
from commander import Chain
from fisher import Episodes

# Smallest expected deviation that is told apart, prior-scaled.
SMALLEST_STD = 1e-6


class FisherVecEnv(VecEnv):
    """`n` episodes that step together; unknowns and start poses are drawn anew for each."""

    def __init__(self, problem, interface, n, seed):
        self.problem = problem
        self.random = np.random.default_rng(seed)
        self.episodes = Episodes(problem, interface, n)
        self.chain = Chain(problem.model, "ee")
        self.num_envs, self.step_count = n, 0
        self.actions = None
        length = self._reset().shape[1]
        box = gymnasium.spaces.Box
        super().__init__(n, box(-np.inf, np.inf, (length,), np.float32), box(-1.0, 1.0, (len(problem.action),), np.float32))

    def _reset(self):
        p, n = self.problem, self.num_envs
        theta = np.stack([self.random.uniform(u.low, u.high, n) for u in p.unknowns], axis=1)
        starts = self.random.uniform(*p.start.T, (n, len(p.start)))
        self.step_count = 0
        return self._observe(self.episodes.begin(theta, starts))

    def reset(self):
        return self._reset()

    def step_async(self, actions):
        self.actions = actions

    def step_wait(self):
        low, high = self.problem.action.T
        actions = low + (np.clip(self.actions, -1.0, 1.0) + 1.0) / 2.0 * (high - low)
        qpos, reward = self.episodes.step(actions)
        self.step_count += 1
        observation = self._observe(qpos)
        over = self.step_count == self.problem.horizon
        infos = [{} for _ in range(self.num_envs)]
        if over:
            # The horizon is part of the task and the time is observed: its end is an end, not a cut.
            infos = [{"terminal_observation": row, "TimeLimit.truncated": False} for row in observation]
            observation = self._reset()
        return observation, reward.astype(np.float32), np.full(self.num_envs, over), infos

    def _observe(self, qpos):
        p, n = self.problem, len(qpos)
        joints = qpos[:, self.chain.qpos]
        hand = self.chain.forward(joints)[0]
        readings = []
        for s in p.signals:
            row = qpos[:, s.at : s.at + s.length]
            if s.length == 4:
                turn = rotation.from_vector(self.random.normal(0.0, s.noise, (n, 3)))
                readings.append(rotation.multiply(turn, row))
            else:
                readings.append(row + self.random.normal(0.0, s.noise, row.shape))
        parts = []
        for i, reading in enumerate(readings):
            if reading.shape[1] == 4:
                matrix = rotation.to_matrix(reading)
                parts += [matrix[:, :, 0], matrix[:, :, 1]]
                continue
            seen = hand - reading
            parts += [reading, seen]
            if i + 1 < len(readings) and readings[i + 1].shape[1] == 4:
                parts.append(np.einsum("nji,nj->ni", rotation.to_matrix(readings[i + 1]), seen))
        share = np.full((n, 1), self.step_count / p.horizon)
        known = -np.log(np.maximum(self.episodes.expected_std(), SMALLEST_STD))
        return np.concatenate([*parts, hand, joints, share, known], axis=1).astype(np.float32)

    def close(self):
        pass

    def env_is_wrapped(self, wrapper_class, indices=None):
        return [False] * self.num_envs

    def env_method(self, method_name, *args, indices=None, **kwargs):
        raise NotImplementedError

    def get_attr(self, attr_name, indices=None):
        return [getattr(self, attr_name, None)] * self.num_envs

    def set_attr(self, attr_name, value, indices=None):
        raise NotImplementedError
