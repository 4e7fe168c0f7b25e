"""What is to be learnt: a model, what is seen of it, what is rewarded, when it is over. One declaration for each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from osimlite.base.records import dataclass
from osimlite.mechanics.multibody.spatial import Array
from osimlite.models.arm import arm as arm_model
from osimlite.models.jumper import jumper
from osimlite.schema.actuators import Actuator
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.model import Model
from osimlite.simulation.options import IntegrationOptions


@dataclass(frozen=True, eq=False)
class Seen:
    """All copies after a step, by names: coordinates ("knee_angle_r"), speeds
    ("knee_angle_r/speed"), states of muscles ("soleus_r/activation"), each (w,).
    """

    columns: dict[str, Array]
    controls: Array  # that were held (w, c)
    step: float  # s

    def __getitem__(self, name: str) -> Array:
        return self.columns[name]


@dataclass(frozen=True, eq=False)
class Task(IntegrationOptions):
    """A task for learners.

    Attributes:
        model: makes what moves.
        reward: of a step (w,), given what was seen before and after it.
        is_over: which copies (w,) have failed.
        hidden: coordinates whose values are not observed, such as how far a walker has come.
        start: makes the state of a copy (y,) from the default one, the names of the states and a
            random generator.
        seconds: of an episode.
        step: for which controls are held, s.

    Besides, options of the integration, such as `accuracy` and `integrator`.
    """

    model: Callable[[], Model]
    reward: Callable[[Seen, Seen], Array]
    is_over: Callable[[Seen], NDArray[np.bool_]]
    hidden: tuple[str, ...] = ()
    start: Callable[[Array, tuple[str, ...], np.random.Generator], Array] | None = None
    seconds: float = 10.0
    step: float = 0.01


CONTACT = "euler2"
"""The integrator where feet touch the ground: contact sets the steps, whose order does not matter then."""
STAND = {
    "pelvis_tilt": -0.05,
    "hip_flexion_r": 0.25,
    "hip_flexion_l": -0.1,
    "knee_angle_r": -0.15,
    "knee_angle_l": -0.2,
    "ankle_angle_r": -0.05,
    "ankle_angle_l": 0.1,
}
"""A pose in which one can begin to walk, rad."""
HEIGHT = 0.93
"""Of the hips then, m."""


def _build_human() -> Model:
    model = jumper(driven=False)
    for coordinate in model.components(Coordinate):
        coordinate.default_value = STAND.get(coordinate.name, coordinate.default_value)
        if coordinate.name == "pelvis_ty":
            coordinate.default_value = HEIGHT
    return model


def _perturb_state(scale: float) -> Callable[[Array, tuple[str, ...], np.random.Generator], Array]:
    """Values and speeds that are a little off."""

    def start(y: Array, names: tuple[str, ...], rng: np.random.Generator) -> Array:
        moving = np.array([name.endswith(("/value", "/speed")) for name in names])
        result = y.copy()
        result[moving] += scale * rng.uniform(-1.0, 1.0, int(moving.sum()))
        return result

    return start


def _compute_effort(seen: Seen) -> Array:
    return np.mean(seen.controls**2, axis=1)


def walk2d() -> Task:
    """A human with sixteen muscles, who is to walk forward at 1.2 m/s and not to fall."""

    def reward(before: Seen, after: Seen) -> Array:
        speed = (after["pelvis_tx"] - before["pelvis_tx"]) / after.step
        return np.exp(-4.0 * (speed - 1.2) ** 2) + 0.2 - 0.1 * _compute_effort(after)

    def is_over(seen: Seen) -> NDArray[np.bool_]:
        return (seen["pelvis_ty"] < 0.7) | (np.abs(seen["pelvis_tilt"]) > 0.8)

    return Task(
        _build_human,
        reward,
        is_over,
        hidden=("pelvis_tx",),
        start=_perturb_state(0.01),
        integrator=CONTACT,
    )


def jump() -> Task:
    """The same human in a squat, who is to jump as high as can be in a second."""

    def reward(before: Seen, after: Seen) -> Array:
        return 10.0 * (after["pelvis_ty"] - before["pelvis_ty"]) - 0.01 * _compute_effort(after)

    def is_over(seen: Seen) -> NDArray[np.bool_]:
        return (seen["pelvis_ty"] < 0.4) | (np.abs(seen["pelvis_tilt"]) > 1.5)

    return Task(
        lambda: jumper(driven=False),
        reward,
        is_over,
        hidden=("pelvis_tx",),
        start=_perturb_state(0.002),
        seconds=1.0,
        integrator=CONTACT,
    )


WANTED = 1.2
"""The angle at which the elbow is to be held, rad."""


def arm() -> Task:
    """A forearm with a weight that is to be held up at 1.2 rad."""

    def reward(before: Seen, after: Seen) -> Array:
        return np.exp(-10.0 * (after["elbow"] - WANTED) ** 2) - 0.05 * _compute_effort(after)

    def is_over(seen: Seen) -> NDArray[np.bool_]:
        return np.abs(seen["elbow"]) > 3.0

    return Task(arm_model, reward, is_over, start=_perturb_state(0.1), seconds=2.0)


TASKS: dict[str, Callable[[], Task]] = {"Walk2D-v0": walk2d, "Jump-v0": jump, "Arm-v0": arm}
"""By the names under which gymnasium knows them, behind ``osimlite/``."""


def of_model(model: Any, reward: Callable[[Seen, Seen], Array], **choices: Any) -> Task:
    """A task with any model, or its file; the episode is over only at its end unless `is_over` is given."""
    from osimlite.io.document.reader import read

    given = read(model) if not isinstance(model, Model) else model
    if not any(isinstance(item, Actuator) for item in given.components()):
        from osimlite.errors import ModelError

        raise ModelError(f"'{given.name}' has no actuators that could be learnt to use")
    choices.setdefault("is_over", lambda seen: np.zeros(len(seen.controls), dtype=bool))
    return Task(lambda: given.copy_deep(), reward, **choices)
