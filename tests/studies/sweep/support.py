"""Model for the tests of sweeps."""

from __future__ import annotations

from osimlite.schema.actuators import CoordinateActuator
from tests.simulation.elements.muscle_rows import hung, muscle


def pulled():
    """Return a model of a block that a muscle with a taut tendon and a motor pull."""
    model = hung(
        muscle("thelen_default", default_activation=0.3, default_fiber_length=0.064), [0.3, 0.3]
    )
    model.tree().by_path["/jointset/slide/x"].default_value = 0.34
    model.add(CoordinateActuator(name="motor", coordinate="x", optimal_force=100.0))
    return model
