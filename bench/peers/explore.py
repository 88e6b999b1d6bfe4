"""Fisher-information PPO with Stable-Baselines3: ASID's networks, settings and number of environment steps."""

import os
import time

import gymnasium
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecNormalize

from environment import FisherVecEnv, separate
from simulation import StepSimulations


class Returns(BaseCallback):
    """Mean return of the episodes of each rollout."""

    def __init__(self):
        super().__init__()
        self.means, self.sum, self.done = [], None, []

    def _on_step(self):
        rewards = np.asarray(self.locals["rewards"], float)
        self.sum = rewards if self.sum is None else self.sum + rewards
        dones = self.locals["dones"]
        self.done += list(self.sum[dones])
        self.sum[dones] = 0.0
        return True

    def _on_rollout_end(self):
        self.means.append(float(np.mean(self.done)) if self.done else None)
        self.done = []


def _cpu_seconds():
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def warm_up():
    """A training of nothing: PyTorch imports a part of itself at the first update, which is no training's time."""
    box = gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float32)

    class Nothing(gymnasium.Env):
        observation_space, action_space = box, box

        def reset(self, *, seed=None, options=None):
            return np.zeros(1, np.float32), {}

        def step(self, action):
            return np.zeros(1, np.float32), 0.0, False, False, {}

    PPO("MlpPolicy", Nothing(), n_steps=8, batch_size=8, n_epochs=1, device="cpu").learn(8)


def train(problem, interface, steps, seed):
    """Trains for `steps` environment steps; seconds of the whole loop, and the mean return of each rollout.

    The clock starts with the environments made, and processes started, which ASID's clock counts.
    """
    ppo = problem.ppo
    torch.set_num_threads(1)
    n = problem.environments
    if interface is StepSimulations:
        environment = separate(problem, n, seed)
    else:
        environment = FisherVecEnv(problem, interface, n, seed)
    if ppo["normalise_observation"]:
        environment = VecNormalize(environment, norm_reward=False, clip_obs=10.0, gamma=ppo["gamma"])
    begin, cpu = time.perf_counter(), _cpu_seconds()
    rate = ppo["learning_rate"]
    learner = PPO(
        "MlpPolicy",
        environment,
        learning_rate=(lambda left: rate * left) if ppo["anneal_learning_rate"] else rate,
        n_steps=-(-ppo["n_steps"] // n),
        batch_size=ppo["minibatch"],
        n_epochs=ppo["epochs"],
        gamma=ppo["gamma"],
        gae_lambda=ppo["lambda"],
        clip_range=ppo["clip"],
        vf_coef=ppo["value_coefficient"],
        ent_coef=ppo["entropy_coefficient"],
        max_grad_norm=ppo["max_gradient_norm"],
        normalize_advantage=ppo["normalise_advantage"],
        policy_kwargs={
            "net_arch": {"pi": ppo["hidden"], "vf": ppo["hidden"]},
            "activation_fn": torch.nn.Tanh,
            "log_std_init": ppo["initial_log_std"],
        },
        seed=seed,
        device="cpu",
    )
    returns = Returns()
    learner.learn(steps, callback=returns)
    seconds = time.perf_counter() - begin
    # The time of processes counts once they have ended.
    environment.close()
    cpu = _cpu_seconds() - cpu
    return {"seconds": seconds, "cpu_seconds": cpu, "environment_steps": learner.num_timesteps, "returns": returns.means}
