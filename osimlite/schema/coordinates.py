"""Generalized coordinates."""

from typing import Annotated

from osimlite.schema.base import ModelComponent, make_empty_list
from osimlite.schema.facts import Facts
from osimlite.schema.fields import Flag, LegacyMany, Optional, real, reals
from osimlite.schema.functions import Function
from osimlite.schema.sets import Set


class Coordinate(ModelComponent):
    """One generalized coordinate of a joint; values of rotational coordinates are in radians."""

    facts = Facts(states="value speed", outputs="acceleration speed value")

    default_value: Annotated[float, real("rad | m")] = 0.0
    """Value at the start of a simulation, before assembly satisfies the constraints."""
    default_speed_value: Annotated[float, real("rad/s | m/s")] = 0.0
    """Generalized speed at the start of a simulation; if the coordinate is locked, it starts with 0."""
    # OpenSim compares the two numbers with each other only if the coordinate is clamped.
    range: Annotated[tuple[float, float], reals("rad | m", least=2, most=2)] = (-10.0, 10.0)
    """Lowest and highest value that a user interface offers; a simulation ignores it."""
    # OpenSim rejects a clamped coordinate whose default value is outside of the range.
    clamped: Flag = False
    """Whether the default and values that are set must lie in `range`; motion may still leave it."""
    # OpenSim reads true, false, 1 and 0 only: after `yes` the coordinate is free, with a line in
    # the log.
    locked: Flag = False
    """Whether a constraint holds the coordinate at its default value, at speed 0."""
    prescribed_function: Optional[Function] = None
    """Value as a function of time; its first two derivatives are used, too."""
    prescribed: Flag = False
    """Whether the coordinate follows `prescribed_function`; without a function it is free."""
    is_free_to_satisfy_constraints: Flag = False
    """Whether assembly may change the coordinate freely; otherwise it stays near its default."""


class CoordinateSet(Set):
    """Coordinates in a separate document."""

    objects: LegacyMany[Coordinate] = make_empty_list()
    """The coordinates."""
