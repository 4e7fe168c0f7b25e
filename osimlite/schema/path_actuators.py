"""Actuators that pull along a path."""

import math
from typing import Annotated

from osimlite.schema.actuators import ScalarActuator
from osimlite.schema.base import made
from osimlite.schema.fields import Number, Single, Tag, real
from osimlite.schema.paths import AbstractGeometryPath, GeometryPath


class PathActuator(ScalarActuator):
    """Pulls along its path with `optimal_force` times the control."""

    geometry_path: Annotated[Single[AbstractGeometryPath], Tag("path")] = made(GeometryPath, name="path")
    optimal_force: Annotated[float, real("N")] = 1.0


class ClutchedPathSpring(PathActuator):
    """A spring along a path that its control engages, with the length it has then as rest length."""

    min_control: Number = 0.0
    max_control: Number = 1.0
    stiffness: Annotated[float, real("N/m", ">= 0")] = math.nan
    dissipation: Annotated[float, real("s/m", ">= 0")] = math.nan
    relaxation_time_constant: Annotated[float, real("s", "> 0")] = 0.001
    initial_stretch: Annotated[float, real("m")] = 0.0


class McKibbenActuator(PathActuator):
    """A pneumatic muscle: a tube in a braid, `cord_length` the part of the path that does not shorten."""

    number_of_turns: Annotated[float, real(domain="> 0")] = 1.5
    thread_length: Annotated[float, real(domain="> 0")] = 200.0
    cord_length: Annotated[float, real(domain=">= 0")] = 0.0
