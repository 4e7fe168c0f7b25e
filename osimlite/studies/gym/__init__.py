"""Reinforcement learning environments: muscle-driven models as gymnasium's `Env` and `VectorEnv`.

`import osimlite.gym` registers `osimlite/Walk2D-v0`, `osimlite/Jump-v0`, `osimlite/Arm-v0` and
`osimlite/Model-v0`. Where osimlite is installed, gymnasium finds them without this import.
"""

from __future__ import annotations

from osimlite.base.require import require

require("gymnasium", extra="gym", purpose="learning environments")

from osimlite.studies.gym.environments import MuscleEnv, MuscleVectorEnv, register_all  # noqa: E402
from osimlite.studies.gym.tasks import TASKS, Task, arm, jump, walk2d  # noqa: E402

__all__ = ["TASKS", "MuscleEnv", "MuscleVectorEnv", "Task", "arm", "jump", "register_all", "walk2d"]

register_all()
