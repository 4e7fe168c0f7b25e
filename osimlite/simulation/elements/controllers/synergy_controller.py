"""Controls of many actuators from few signals, each spread by its synergy vector."""

from __future__ import annotations

from collections.abc import Iterator

from osimlite.errors import ModelError, UnsupportedError
from osimlite.mechanics.multibody.functions import Scaled
from osimlite.schema.controller_types import SynergyController
from osimlite.simulation.elements.controls import Drive, named
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.signals import signal


def drives(builder: ElementBuilder, controller: SynergyController) -> Iterator[Drive]:
    """The signals times the weights of each control; nothing without signals.

    Raises:
        ModelError: there is not one signal for each vector, or not one weight for each control.
    """
    path, vectors = builder.path(controller), controller.synergy_vectors
    counts = [
        (item, getattr(type(item), "control_count", 1)) for item in named(builder, controller)
    ]
    targets = [(item, number) for item, count in counts for number in range(count)]
    for vector in vectors:
        if len(vector.synergy_weights) != len(targets):
            raise ModelError(
                f"the synergy vector '{vector.name}' of '{path}' has {len(vector.synergy_weights)} weights for "
                f"{len(targets)} controls; give it one for each"
            )
    words = controller.input_controls
    if words and len(words) != len(vectors):
        raise ModelError(
            f"'{path}' has {len(words)} inputs for {len(vectors)} synergy vectors; give it one for each"
        )
    for vector, word in zip(vectors, words, strict=False):
        function = signal(builder, controller, word)
        for (actuator, number), weight in zip(targets, vector.synergy_weights, strict=True):
            if function is None:
                refused: UnsupportedError = builder.unsupported(
                    actuator,
                    f" driven by '{path}', whose input '{word}' is no function of time that is known",
                )
                yield Drive(actuator, refused)
            else:
                yield Drive(actuator, Scaled(weight, function), number)
