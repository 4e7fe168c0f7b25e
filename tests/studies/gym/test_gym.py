"""Tests of the environments for gymnasium: its checker, seeds, and vector environments against single ones."""

from __future__ import annotations

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium", reason="needs gymnasium (extra 'gym')")

from gymnasium.utils.env_checker import check_env  # noqa: E402

import osimlite  # noqa: E402
from osimlite.base.records import replace  # noqa: E402
from osimlite.errors import OsimliteError, SettingError  # noqa: E402
from osimlite.simulation.options import INTEGRATORS  # noqa: E402
from osimlite.studies.gym.environments import MuscleEnv, MuscleVectorEnv  # noqa: E402
from osimlite.studies.gym.tasks import TASKS  # noqa: E402

NAMES = [f"osimlite/{name}" for name in TASKS]


@pytest.mark.parametrize("name", NAMES)
def test_gymnasium_finds_nothing_wrong(name: str) -> None:
    env = gymnasium.make(name, render_mode="rgb_array").unwrapped
    check_env(env)
    picture = env.render()
    assert picture.shape == (360, 480, 3) and picture.std() > 5.0
    env.close()


@pytest.mark.parametrize(
    ("name", "count", "integrator"),
    [
        ("Arm-v0", 64, "merson"),
        ("Walk2D-v0", 6, "merson"),
        *(("Arm-v0", 5, name) for name in INTEGRATORS),
    ],
)
def test_copies_are_single_environments_bit_for_bit(name: str, count: int, integrator: str) -> None:
    """Compare over episodes that end and restart, next to another environment of the same model."""
    task = replace(TASKS[name](), integrator=integrator, seconds=0.2)
    many, another, one = MuscleVectorEnv(count, task), MuscleVectorEnv(2, task), MuscleEnv(task)
    rng = np.random.default_rng(0)
    actions = [rng.random(many.action_space.shape, dtype=np.float32) for _ in range(45)]
    first, _ = many.reset(seed=5)
    another.reset(seed=1)
    found = []
    for action in actions:
        found.append(many.step(action)[:4])
        another.step(action[:2])
    for k in range(count):
        observation, _ = one.reset(seed=5 + k)
        assert np.array_equal(observation, first[k])
        is_over = False
        for action, (observations, rewards, over, late) in zip(actions, found, strict=True):
            if is_over:
                observation, reward, ended = one.reset()[0], 0.0, [False, False]
            else:
                observation, reward, *ended, _ = one.step(action[k])
            assert np.array_equal(observation, observations[k]) and reward == rewards[k]
            assert (over[k], late[k]) == tuple(ended)
            is_over = any(ended)
    for env in (many, another, one):
        env.close()


def test_steps_go_by_the_integrator_of_the_task() -> None:
    """The motions differ by the errors of the integrators only."""
    ends = {}
    for name in INTEGRATORS:
        env = MuscleEnv(replace(TASKS["Arm-v0"](), integrator=name, accuracy=1e-6))
        env.reset(seed=3)
        for number in range(30):
            observation, *_ = env.step(np.array([0.3, 0.1 * (number % 3)], dtype=np.float32))
        ends[name] = observation
        env.close()
    merson = ends.pop("merson")
    for other in ends.values():
        assert 0.0 < np.abs(other - merson).max() < 1e-3


def test_copies_begin_anew_after_their_episodes() -> None:
    many = gymnasium.make_vec("osimlite/Arm-v0", num_envs=2)
    many.reset(seed=0)
    actions = np.array([[0.0, 0.0], [0.2, 0.0]], dtype=np.float32)
    for number in range(1, 203):
        observations, rewards, over, late, _ = many.step(actions)
        assert not over.any()
        if number == 200:
            assert late.all()
        elif number == 201:
            assert (
                not late.any()
                and (rewards == 0.0).all()
                and np.abs(observations[:, 0] - 0.5).max() < 0.11
            )
        else:
            assert not late.any() and (rewards != 0.0).all()
    many.close()


def test_any_model_has_a_task(tmp_path) -> None:
    from osimlite.models.jumper import jumper
    from osimlite.models.walkers import furthest_walker

    osimlite.write(jumper(driven=False), tmp_path / "jumper.osim")
    env = gymnasium.make(
        "osimlite/Model-v0",
        model=tmp_path / "jumper.osim",
        reward=lambda before, after: after["pelvis_ty"] - before["pelvis_ty"],
        hidden=("pelvis_tx",),
        seconds=0.05,
    ).unwrapped
    assert (
        "pelvis_tx" not in env.labels
        and "soleus_r/activation" in env.labels
        and len(env.controls) == 16
    )
    env.reset(seed=1)
    ends = [env.step(np.full(16, 0.02, dtype=np.float32))[3] for _ in range(5)]
    assert ends == [False] * 4 + [True]
    with pytest.raises(OsimliteError, match="no actuators"):
        gymnasium.make(
            "osimlite/Model-v0", model=furthest_walker(), reward=lambda before, after: 0.0
        )
    with pytest.raises(gymnasium.error.Error, match="pass a task"):
        gymnasium.make("osimlite/Model-v0")


@pytest.mark.parametrize(
    ("choices", "words"),
    [
        ({"secnods": 1.0}, "a task has no 'secnods'.*did you mean 'seconds'"),
        ({"render_mode": "human"}, "must be 'rgb_array', not 'human'"),
        ({"hidden": ("shoulder",)}, "has no state 'shoulder' to hide"),
        ({"model": "arm.osim"}, "this environment has a fixed model"),
    ],
)
def test_what_an_environment_does_not_know_is_refused(choices, words) -> None:
    with pytest.raises(gymnasium.error.Error, match=words):
        gymnasium.make("osimlite/Arm-v0", **choices).unwrapped.close()


@pytest.mark.parametrize(
    "choice", [{"seconds": -1}, {"seconds": float("nan")}, {"step": 0.0}, {"step": float("inf")}]
)
def test_durations_are_positive(choice) -> None:
    (name,) = choice
    with pytest.raises(SettingError, match=f"'{name}' must be a positive number, not"):
        gymnasium.make("osimlite/Arm-v0", **choice)


def test_one_hidden_name_is_no_tuple() -> None:
    with pytest.raises(SettingError, match=r"'hidden' must be a tuple of names.*\('elbow',\)"):
        gymnasium.make("osimlite/Arm-v0", hidden="elbow")


def test_there_is_at_least_one_copy() -> None:
    with pytest.raises(SettingError, match="'num_envs' must be at least 1, not -1"):
        gymnasium.make_vec("osimlite/Arm-v0", num_envs=-1)


def test_actions_that_are_no_numbers_are_refused() -> None:
    action = np.array([0.1, np.nan])
    env = gymnasium.make("osimlite/Arm-v0").unwrapped
    env.reset(seed=0)
    with pytest.raises(gymnasium.error.InvalidAction, match=r"'/forceset/\w+' of copy 0 is NaN"):
        env.step(action)
    env.close()
    envs = gymnasium.make_vec("osimlite/Arm-v0", num_envs=2, seconds=0.01).unwrapped
    envs.reset(seed=0)
    actions = np.stack((np.zeros(2), action))
    with pytest.raises(gymnasium.error.InvalidAction, match="of copy 1 is NaN"):
        envs.step(actions)
    assert envs.step(np.zeros((2, 2)))[3].all()
    # This step starts new episodes, and ignores the actions.
    envs.step(actions)
    envs.close()


def test_a_reward_that_misspells_a_state_names_the_nearest() -> None:
    env = gymnasium.make("osimlite/Arm-v0", reward=lambda before, after: after["elbo"]).unwrapped
    env.reset(seed=0)
    with pytest.raises(SettingError, match=r"has no state 'elbo'; did you mean 'elbow'\?"):
        env.step(np.zeros(2))
    env.close()


def test_a_task_can_be_another_in_parts() -> None:
    env = gymnasium.make(
        "osimlite/Arm-v0", seconds=0.02, reward=lambda before, after: np.full(1, 7.0)
    ).unwrapped
    env.reset(seed=0)
    action = np.zeros(env.action_space.shape)
    assert env.step(action)[1] == 7.0 and env.step(action)[3]
    with pytest.raises(
        gymnasium.error.InvalidAction, match=r"actions have the shape \(1, 2\), not \(1, 3\)"
    ):
        env.step(np.zeros(3))
    env.close()
