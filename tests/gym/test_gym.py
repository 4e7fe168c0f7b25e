"""Environments of gymnasium: what its checker says, seeds, and many copies beside single ones."""

from __future__ import annotations

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium", reason="needs gymnasium (extra 'gym')")
pytest.importorskip("numba", reason="needs numba (extra 'sim')")

from gymnasium.utils.env_checker import check_env  # noqa: E402

import osimlite  # noqa: E402
from osimlite.errors import OsimliteError  # noqa: E402
from osimlite.gym.tasks import TASKS  # noqa: E402

NAMES = [f"osimlite/{name}" for name in TASKS]


@pytest.mark.parametrize("name", NAMES)
def test_gymnasium_finds_nothing_wrong(name: str) -> None:
    env = gymnasium.make(name, render_mode="rgb_array").unwrapped
    check_env(env)
    picture = env.render()
    assert picture.shape == (360, 480, 3) and picture.std() > 5.0
    env.close()


@pytest.mark.parametrize(("name", "count"), [("osimlite/Arm-v0", 64), ("osimlite/Walk2D-v0", 6)])
def test_copies_are_single_environments_bit_for_bit(name: str, count: int) -> None:
    many = gymnasium.make_vec(name, num_envs=count)
    rng = np.random.default_rng(0)
    actions = [
        many.action_space.sample() * 0 + rng.random(many.action_space.shape).astype(np.float32) for _ in range(12)
    ]
    first, _ = many.reset(seed=5)
    found = [many.step(action) for action in actions]
    for k in (0, 1, count - 1):
        one = gymnasium.make(name).unwrapped
        observation, _ = one.reset(seed=5 + k)
        assert np.array_equal(observation, first[k])
        for action, (observations, rewards, over, _, _) in zip(actions, found, strict=True):
            observation, reward, is_over, _, _ = one.step(action[k])
            assert np.array_equal(observation, observations[k]) and reward == rewards[k] and is_over == over[k]
            if is_over:
                break
        one.close()
    many.close()


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
            assert not late.any() and (rewards == 0.0).all() and np.abs(observations[:, 0] - 0.5).max() < 0.11
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
    assert "pelvis_tx" not in env.labels and "soleus_r/activation" in env.labels and len(env.controls) == 16
    env.reset(seed=1)
    ends = [env.step(np.full(16, 0.02, dtype=np.float32))[3] for _ in range(5)]
    assert ends == [False] * 4 + [True]
    with pytest.raises(OsimliteError, match="no actuators"):
        gymnasium.make("osimlite/Model-v0", model=furthest_walker(), reward=lambda before, after: 0.0)
    with pytest.raises(gymnasium.error.Error, match="give a task"):
        gymnasium.make("osimlite/Model-v0")
