"""Steps of 10 ms of the environments per second, on all cores and of one (processor time).

    python benchmarks/gym.py [COPIES]

Actions are random excitations up to 0.3; copies that fall begin anew.
"""

from __future__ import annotations

import sys
import time

import gymnasium
import numpy as np

import osimlite.gym
from osimlite.base.cores import count_cores

STEPS = 100


def main() -> None:
    """Print a line for each environment."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 64
    for name in osimlite.gym.TASKS:
        envs = gymnasium.make_vec(f"osimlite/{name}", num_envs=count)
        rng = np.random.default_rng(0)
        envs.reset(seed=0)
        actions = [
            0.3 * rng.random(envs.action_space.shape, dtype=np.float32) for _ in range(STEPS)
        ]
        envs.step(actions[0])
        start, spent = time.perf_counter(), time.process_time()
        for action in actions:
            envs.step(action)
        took, spent = time.perf_counter() - start, time.process_time() - spent
        rate, own = count * STEPS / took, count * STEPS / spent
        print(
            f"{name:12s} {rate:10,.0f} steps/s, {count} copies, {count_cores()} cores; {own:,.0f} of one core"
        )
        envs.close()


if __name__ == "__main__":
    main()
