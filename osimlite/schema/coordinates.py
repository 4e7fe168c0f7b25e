"""Generalized coordinates."""

from typing import Annotated

from osimlite.schema.base import ModelComponent
from osimlite.schema.fields import Flag, Optional, real, reals
from osimlite.schema.functions import Function


class Coordinate(ModelComponent):
    """One generalized coordinate of a joint.

    Values of rotational coordinates are in radians. `range` limits nothing in a simulation: it is where a user
    interface lets the coordinate go, and where `clamped` requires the default to be. `locked` holds the coordinate at
    its default value.
    """

    default_value: Annotated[float, real("rad | m")] = 0.0
    default_speed_value: Annotated[float, real("rad/s | m/s")] = 0.0
    range: Annotated[tuple[float, float], reals("rad | m", least=2, most=2)] = (-10.0, 10.0)
    clamped: Flag = False
    locked: Flag = False
    prescribed_function: Optional[Function] = None
    prescribed: Flag = False
    is_free_to_satisfy_constraints: Flag = False
