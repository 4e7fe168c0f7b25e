"""A pneumatic muscle, whose control is a pressure."""

from osimlite.mechanics.laws.springs import mckibben_tension
from osimlite.schema.path_actuators import McKibbenActuator
from osimlite.simulation.elements.geometries.path import PATH
from osimlite.simulation.elements.kind import Kind
from osimlite.simulation.elements.parameters import Number

KIND = Kind(
    McKibbenActuator,
    PATH,
    mckibben_tension,
    inputs=("length",),
    outputs=("tension",),
    parameters=(
        Number("number_of_turns", lambda value: value != 0.0, "is 0; give it some"),
        "thread_length",
        "cord_length",
    ),
    controlled=True,
    labels={"{name}": "tension"},
)
