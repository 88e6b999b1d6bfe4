"""Fisher exploration as a vectorised environment of Stable-Baselines3, with ASID's observations.

An observation is a noisy reading (an orientation as two columns of its matrix, the hand also seen from the object), the
share of the episode that is over, and the information gathered so far.
"""

import gymnasium
import numpy as np
from stable_baselines3.common.vec_env import SubprocVecEnv, VecEnv

import rotation
from commander import chain_to_hand
from fisher import Episodes
from simulation import StepSimulations

# Smallest expected deviation that is told apart, prior-scaled.
SMALLEST_STD = 1e-6


class FisherVecEnv(VecEnv):
    """`n` episodes that step together; unknowns and start poses are drawn anew for each."""

    def __init__(self, problem, interface, n, seed):
        self.problem = problem
        self.random = np.random.default_rng(seed)
        self.episodes = Episodes(problem, interface, n)
        self.chain = chain_to_hand(problem, n)
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


class FisherEnv(gymnasium.Env):
    """One episode as an environment of Gymnasium, stepped by `mj_step` in Python."""

    def __init__(self, problem, seed):
        self.inner = FisherVecEnv(problem, StepSimulations, 1, seed)
        self.observation_space, self.action_space = self.inner.observation_space, self.inner.action_space
        self.first = None

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        # An episode that ended has begun the next one already.
        first, self.first = self.first, None
        return (self.inner.reset()[0] if first is None else first), {}

    def step(self, action):
        self.inner.step_async(np.asarray(action)[None])
        observation, reward, done, info = self.inner.step_wait()
        if done[0]:
            self.first, last = observation[0], info[0]["terminal_observation"]
            return last, float(reward[0]), True, False, {}
        return observation[0], float(reward[0]), False, False, {}


def separate(problem, n, seed):
    """`n` environments of Gymnasium, a process each: how vectorised environments are commonly made."""
    makers = [lambda i=i: FisherEnv(problem, seed * n + i) for i in range(n)]
    return SubprocVecEnv(makers, start_method="fork")
