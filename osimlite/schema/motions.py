"""Prescribed motions, and forces that a program sets while it simulates."""

from osimlite.schema.base import ModelComponent, make_default
from osimlite.schema.fields import Flag, Single
from osimlite.schema.functions import FunctionSet


class PositionMotion(ModelComponent):
    """Moves every coordinate by a function of time, one for each."""

    default_enabled: Flag = True
    """Whether coordinates follow the motion from the start."""
    functions: Single[FunctionSet] = make_default(FunctionSet, name="functions")
    """A function of time for every coordinate, with the path of the coordinate as its name."""


class AccelerationMotion(ModelComponent):
    """Moves every coordinate by an acceleration that a program sets."""


class DiscreteForces(ModelComponent):
    """Generalized and body forces that a program sets."""
