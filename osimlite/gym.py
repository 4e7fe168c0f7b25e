"""Environments for learning, under the name that users import: see :mod:`osimlite.studies.gym`.

``import osimlite.gym`` registers ``osimlite/Walk2D-v0``, ``osimlite/Jump-v0``, ``osimlite/Arm-v0``
and ``osimlite/Model-v0``; gymnasium finds them by itself where osimlite is installed.
"""

from osimlite.studies.gym import (
    TASKS,
    MuscleEnv,
    MuscleVectorEnv,
    Task,
    arm,
    jump,
    register_all,
    walk2d,
)

__all__ = ["TASKS", "MuscleEnv", "MuscleVectorEnv", "Task", "arm", "jump", "register_all", "walk2d"]
