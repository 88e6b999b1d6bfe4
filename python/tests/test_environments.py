"""The tasks as environments: gymnasium's own checker, batches, and what Python costs."""

import time
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import asid
from asid import _native
from asid.environments import ExplorationVectorEnv, name

TASKS = [task for task, _ in asid.tasks()]

#: Share of Rust's steps a second that a batch in Python keeps.
KEPT = 0.9


def test_every_task_is_registered():
    assert len(TASKS) >= 7
    assert name("rod-balancing") == "asid/RodBalancing-v0"
    for task in TASKS:
        assert name(task) in gymnasium.registry


@pytest.mark.parametrize("task", TASKS)
def test_gymnasium_s_checker_passes(task):
    environment = gymnasium.make(name(task))
    with warnings.catch_warnings():
        warnings.simplefilter("error", category=DeprecationWarning)
        check_env(environment.unwrapped)


@pytest.mark.parametrize("backend", ["rapier", "mujoco"])
def test_a_batch_steps_to_the_horizon_and_begins_anew(backend):
    environment = gymnasium.make_vec("asid/SphereStriking-v0", num_envs=3, backend=backend)
    assert isinstance(environment.unwrapped, ExplorationVectorEnv)
    environment.action_space.seed(1)
    first, info = environment.reset(seed=4)
    assert first in environment.observation_space and first.dtype == np.float32
    total = np.zeros(3)
    horizon = environment.unwrapped.episodes.horizon
    before = info["expected_std"]
    for step in range(horizon):
        observation, reward, terminated, truncated, info = environment.step(environment.action_space.sample())
        total += reward
        assert terminated.all() == (step == horizon - 1) and not truncated.any()
    assert info["final_obs"].shape == first.shape and not np.array_equal(info["final_obs"], observation)
    # What has been learned is paid for: under the A-optimal objective the sum of the variances only falls.
    assert (info["expected_std"] <= before + 1e-6).all() and (total >= -1e-9).all()
    again, _ = environment.reset(seed=4)
    np.testing.assert_array_equal(first, again)
    other, _ = environment.reset(seed=[1, 2, 3])
    assert not np.array_equal(first, other)


def test_the_reward_is_the_decrease_of_the_variance():
    played = asid.play("sphere-striking", lambda seen: np.zeros((len(seen), 2)), episodes=2, nuisance=False)
    gained = played.rewards.sum(axis=1)
    np.testing.assert_allclose(gained, 1.0 - (played.expected_std**2).sum(axis=1), rtol=1e-3, atol=1e-5)


def test_explorer_policy_and_metric_are_functions():
    def explorer(environment):
        rng = np.random.default_rng(0)
        plan = rng.uniform(-1, 1, environment.single_action_space.shape)
        return lambda observation: np.broadcast_to(plan, environment.action_space.shape)

    played = asid.play("shuffleboard", explorer=explorer, metric=lambda seen, done: float(len(seen)), episodes=4)
    steps = played.actions.shape[1]
    assert (played.metric == steps + 1).all() and played.unknowns == ["sliding_friction", "torsional_friction"]
    with pytest.raises(asid.UsageError, match="shape"):
        asid.play("shuffleboard", lambda observation: np.zeros(3), episodes=2)


def test_wrong_calls_say_what_is_known():
    with pytest.raises(asid.UsageError, match="`rod-balancing`"):
        _native.Episodes("rod-balancin", 1)
    with pytest.raises(asid.UsageError, match="num_envs"):
        ExplorationVectorEnv("rod-balancing", 0)
    environment = ExplorationVectorEnv("sphere-striking", 2)
    environment.reset(seed=0)
    with pytest.raises(asid.UsageError, match="shape"):
        environment.step(np.zeros((3, 2)))
    with pytest.raises(asid.UsageError, match="episode 1"):
        environment.step(np.array([[0.0] * 2, [np.nan] * 2]))


def test_a_batch_is_as_fast_as_in_rust():
    """What the simulator takes is timed in Rust, within the same steps: what else runs on the machine slows both."""
    environment = ExplorationVectorEnv("sphere-striking", 32, backend="mujoco")
    environment.reset(seed=0)
    actions = np.zeros(environment.action_space.shape, np.float32)
    before = environment.episodes.seconds
    clock = time.perf_counter()
    for _ in range(10):
        environment.step(actions)
    kept = (environment.episodes.seconds - before) / (time.perf_counter() - clock)
    print(f"{kept:.4f} of the steps a second in Rust")
    assert KEPT <= kept <= 1.0
