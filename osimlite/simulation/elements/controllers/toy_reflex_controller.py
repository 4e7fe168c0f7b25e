"""Controls of muscles in proportion to how fast they lengthen."""

from __future__ import annotations

from collections.abc import Iterator

from osimlite.errors import ModelError
from osimlite.schema.actuators import Actuator
from osimlite.schema.examples import ToyReflexController
from osimlite.schema.muscles import Muscle
from osimlite.simulation.elements.controls import Drive, Reflex, named
from osimlite.simulation.elements.gather import ElementBuilder


def drives(builder: ElementBuilder, controller: ToyReflexController) -> Iterator[Drive]:
    """The gain where a muscle lengthens at its greatest contraction velocity, less where it is slower.

    Raises:
        ModelError: it names an actuator that is no muscle.
    """
    for muscle in named(builder, controller):
        if isinstance(muscle, Actuator) and not isinstance(muscle, Muscle):
            raise ModelError(
                f"'{builder.path(controller)}' drives '{builder.path(muscle)}', which is no muscle; name muscles only"
            )
        yield Drive(muscle, Reflex(controller.gain))
