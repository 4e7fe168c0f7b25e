"""Measure how many steps per second the learning environments make.

    python benchmarks/gym.py [COPIES]

Each environment runs in COPIES copies (64 by default) for 100 steps of 10 ms. The actions are
random excitations up to 0.3; a copy that falls starts again. For each environment a line gives the
steps per second of wall time, which uses all cores, and per second of processor time, which is the
rate of one core.
"""

from __future__ import annotations

import sys
import time

import gymnasium
import numpy as np

import osimlite.gym
from osimlite.base.cores import count_cores

STEP_COUNT = 100
"""Number of timed steps of each copy."""

MAX_EXCITATION = 0.3
"""Largest excitation of the random actions."""

DEFAULT_COPIES = 64


def measure_rates(name: str, copies: int) -> tuple[float, float]:
    """Measure one environment.

    Args:
        name: name of the environment, such as ``Walk2D-v0``.
        copies: number of copies that step together.

    Returns:
        Steps per second of wall time, and steps per second of processor time.
    """
    envs = gymnasium.make_vec(f"osimlite/{name}", num_envs=copies)
    rng = np.random.default_rng(0)
    envs.reset(seed=0)
    # All actions are drawn before the time starts, in single precision as the environments want.
    actions = [
        MAX_EXCITATION * rng.random(envs.action_space.shape, dtype=np.float32)
        for _ in range(STEP_COUNT)
    ]
    # The first step is not measured: it may prepare what later steps find ready.
    envs.step(actions[0])
    wall_start = time.perf_counter()
    processor_start = time.process_time()
    for action in actions:
        envs.step(action)
    wall_time = time.perf_counter() - wall_start
    processor_time = time.process_time() - processor_start
    envs.close()
    steps = copies * STEP_COUNT
    return steps / wall_time, steps / processor_time


def main() -> None:
    """Print a line for each environment."""
    copies = int(sys.argv[1]) if len(sys.argv) > 1 else DEFAULT_COPIES
    for name in osimlite.gym.TASKS:
        rate, rate_per_core = measure_rates(name, copies)
        print(
            f"{name:12s} {rate:10,.0f} steps/s with {copies} copies on {count_cores()} cores; "
            f"{rate_per_core:,.0f} steps/s of one core"
        )


if __name__ == "__main__":
    main()
