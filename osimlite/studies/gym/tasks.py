"""Tasks for reinforcement learning, one declaration each: model, observations, reward and termination."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from osimlite.base.records import dataclass
from osimlite.base.text import suggest_or_list
from osimlite.errors import SettingError
from osimlite.mechanics.multibody.spatial import Array
from osimlite.models.arm import arm as arm_model
from osimlite.models.jumper import jumper
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.forces import Actuator
from osimlite.schema.model import Model
from osimlite.simulation.options import IntegrationOptions


@dataclass(frozen=True, eq=False)
class Observation:
    """States of all copies after a step, by name.

    Attributes:
        columns: values of coordinates ("knee_angle_r", rad or m), speeds ("knee_angle_r/speed") and
            states of muscles ("soleus_r/activation"), each (w,).
        controls: controls that were held in the step (w, c).
        step: duration of the step (s).
    """

    columns: dict[str, Array]
    controls: Array
    step: float

    def __getitem__(self, name: str) -> Array:
        try:
            return self.columns[name]
        except KeyError:
            raise SettingError(
                f"the environment has no state '{name}'{suggest_or_list(name, self.columns)}"
            ) from None


@dataclass(frozen=True, eq=False)
class Task(IntegrationOptions):
    """Task for reinforcement learning.

    Options of the integration, such as `accuracy` and `integrator`, are attributes too.

    Attributes:
        model: function that returns the model.
        reward: function of the observations before and after a step that returns rewards (w,).
        is_over: function of an observation that returns which copies have failed (w,).
        hidden: coordinates that are not observed, for example the position of a walker.
        start: function that returns an initial state (y,) from the default one, the paths of the
            states and a random generator; None for the default state.
        seconds: duration of an episode (s).
        step: duration of a control step (s).
    """

    model: Callable[[], Model]
    reward: Callable[[Observation, Observation], Array]
    is_over: Callable[[Observation], NDArray[np.bool_]]
    hidden: tuple[str, ...] = ()
    start: Callable[[Array, tuple[str, ...], np.random.Generator], Array] | None = None
    seconds: float = 10.0
    step: float = 0.01


CONTACT_INTEGRATOR = "euler2"
"""Integrator for models with ground contact: contact limits the step size, so that a higher order
does not pay.
"""
STANDING_POSE = {
    "pelvis_tilt": -0.05,
    "hip_flexion_r": 0.25,
    "hip_flexion_l": -0.1,
    "knee_angle_r": -0.15,
    "knee_angle_l": -0.2,
    "ankle_angle_r": -0.05,
    "ankle_angle_l": 0.1,
}
"""Pose in which a walk can start (rad)."""
HIP_HEIGHT_M = 0.93
"""Height of the hips in this pose (m)."""


def _build_human() -> Model:
    """Return the jumper in `STANDING_POSE`, without controllers."""
    model = jumper(driven=False)
    for coordinate in model.components(Coordinate):
        coordinate.default_value = STANDING_POSE.get(coordinate.name, coordinate.default_value)
        if coordinate.name == "pelvis_ty":
            coordinate.default_value = HIP_HEIGHT_M
    return model


def _perturb_state(scale: float) -> Callable[[Array, tuple[str, ...], np.random.Generator], Array]:
    """Return a function that adds uniform random numbers up to `scale` to all values and speeds."""

    def start(y: Array, names: tuple[str, ...], rng: np.random.Generator) -> Array:
        # Muscle states are left alone: they depend on the pose.
        is_perturbed = np.array([name.endswith(("/value", "/speed")) for name in names])
        result = y.copy()
        # Small perturbations keep learners from memorizing one motion.
        result[is_perturbed] += scale * rng.uniform(-1.0, 1.0, int(is_perturbed.sum()))
        return result

    return start


def _compute_effort(observation: Observation) -> Array:
    """Return the mean squared control of each copy (w,)."""
    return np.mean(observation.controls**2, axis=1)


def walk2d() -> Task:
    """Return the task of a human with 16 muscles to walk forward at 1.2 m/s without a fall."""

    def reward(before: Observation, after: Observation) -> Array:
        speed = (after["pelvis_tx"] - before["pelvis_tx"]) / after.step
        # Speed is rewarded, 0.2 is for each step without a fall, and effort is penalized.
        return np.exp(-4.0 * (speed - 1.2) ** 2) + 0.2 - 0.1 * _compute_effort(after)

    def is_over(observation: Observation) -> NDArray[np.bool_]:
        # The hips are low or the trunk leans so far that a recovery is unlikely.
        return (observation["pelvis_ty"] < 0.7) | (np.abs(observation["pelvis_tilt"]) > 0.8)

    return Task(
        _build_human,
        reward,
        is_over,
        hidden=("pelvis_tx",),
        start=_perturb_state(0.01),
        integrator=CONTACT_INTEGRATOR,
    )


def jump() -> Task:
    """Return the task of the same human in a squat to jump as high as possible within one second."""

    def reward(before: Observation, after: Observation) -> Array:
        # Rewards of all steps add up to ten times the rise of the hips.
        return 10.0 * (after["pelvis_ty"] - before["pelvis_ty"]) - 0.01 * _compute_effort(after)

    def is_over(observation: Observation) -> NDArray[np.bool_]:
        return (observation["pelvis_ty"] < 0.4) | (np.abs(observation["pelvis_tilt"]) > 1.5)

    return Task(
        lambda: jumper(driven=False),
        reward,
        is_over,
        hidden=("pelvis_tx",),
        start=_perturb_state(0.002),
        seconds=1.0,
        integrator=CONTACT_INTEGRATOR,
    )


TARGET_ANGLE_RAD = 1.2
"""Angle at which the elbow is to be held (rad)."""


def arm() -> Task:
    """Return the task of a forearm with a weight to hold the elbow at 1.2 rad."""

    def reward(before: Observation, after: Observation) -> Array:
        return np.exp(-10.0 * (after["elbow"] - TARGET_ANGLE_RAD) ** 2) - 0.05 * _compute_effort(
            after
        )

    def is_over(observation: Observation) -> NDArray[np.bool_]:
        return np.abs(observation["elbow"]) > 3.0

    return Task(arm_model, reward, is_over, start=_perturb_state(0.1), seconds=2.0)


TASKS: dict[str, Callable[[], Task]] = {"Walk2D-v0": walk2d, "Jump-v0": jump, "Arm-v0": arm}
"""Tasks by the names under which gymnasium knows them, after `osimlite/`."""


def make_task(
    model: Any, reward: Callable[[Observation, Observation], Array], **options: Any
) -> Task:
    """Return a task with any model, whose episodes end by time only unless `is_over` is set.

    Args:
        model: model, or its file.
        reward: function of the observations before and after a step that returns rewards (w,).
        options: further attributes of the task.

    Raises:
        ModelError: the model has no actuators.
    """
    from osimlite.io.document.reader import read

    template = read(model) if not isinstance(model, Model) else model
    if not any(isinstance(component, Actuator) for component in template.components()):
        from osimlite.errors import ModelError

        raise ModelError(f"'{template.name}' has no actuators for an agent to control; add some")
    options.setdefault(
        "is_over", lambda observation: np.zeros(len(observation.controls), dtype=bool)
    )
    return Task(lambda: template.copy_deep(), reward, **options)
