"""Test that an evolution strategy learns a linear feedback for the arm."""

from __future__ import annotations

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium", reason="needs gymnasium (extra 'gym')")

import osimlite.studies.gym  # noqa: E402, F401


@pytest.mark.full
def test_the_arm_learns_to_hold_the_weight() -> None:
    # Import here: each process that collects this module would load it, which takes seconds.
    cma = pytest.importorskip("cma", reason="needs cma (extra 'optimize')")
    envs = gymnasium.make_vec("osimlite/Arm-v0", num_envs=4)
    size = envs.single_observation_space.shape[0]

    def returns(weights: np.ndarray) -> float:
        gains = np.array(weights).reshape(2, size + 1)
        observations, _ = envs.reset(seed=0)
        total = np.zeros(4)
        for _ in range(200):
            actions = 0.2 + observations @ gains[:, :-1].T + gains[:, -1]
            observations, rewards, *_ = envs.step(np.clip(actions, 0.0, 1.0).astype(np.float32))
            total += rewards
        return float(total.mean())

    start = np.zeros(2 * (size + 1))
    before = returns(start)
    search = cma.CMAEvolutionStrategy(start, 0.5, {"maxiter": 12, "verbose": -9, "seed": 1})
    search.optimize(lambda weights: -returns(weights))
    assert returns(search.result.xbest) > before + 40.0
    envs.close()
