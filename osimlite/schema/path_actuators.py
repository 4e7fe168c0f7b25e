"""Actuators that pull along a path."""

import math
from typing import Annotated

from osimlite.schema.actuators import ScalarActuator
from osimlite.schema.base import made
from osimlite.schema.facts import IDLE, STOPS, Facts
from osimlite.schema.fields import Number, Single, Tag, real
from osimlite.schema.paths import AbstractGeometryPath, GeometryPath


class PathActuator(ScalarActuator):
    """Pulls along its path with `optimal_force` times the control."""

    facts = Facts(
        outputs="tension", domains={"optimal_force": "!= 0"}, doubts={"optimal_force": IDLE}
    )

    geometry_path: Annotated[Single[AbstractGeometryPath], Tag("path")] = made(
        GeometryPath, name="path"
    )
    """The line along which the actuator pulls."""
    optimal_force: Annotated[float, real("N")] = 1.0
    """Tension at a control of 1; classes with a law of their own do without it."""


class ClutchedPathSpring(PathActuator):
    """A spring along a path that its control engages, with the length it has then as rest length."""

    facts = Facts(
        states="stretch",
        domains={"initial_stretch": ">= 0"},
        refused="stiffness dissipation relaxation_time_constant initial_stretch",
        zero={STOPS: "relaxation_time_constant"},
    )

    min_control: Number = 0.0
    max_control: Number = 1.0
    stiffness: Annotated[float, real("N/m", ">= 0")] = math.nan
    """Tension per stretch at a control of 1; less control pulls proportionally less."""
    dissipation: Annotated[float, real("s/m", ">= 0")] = math.nan
    """The c of 1 + c v, by which the lengthening speed v raises the tension."""
    relaxation_time_constant: Annotated[float, real("s", "> 0")] = 0.001
    """Time constant with which the stretch fades while the control is 0."""
    initial_stretch: Annotated[float, real("m")] = 0.0
    """Stretch at the start of a simulation."""


class McKibbenActuator(PathActuator):
    """A pneumatic muscle: a tube in a braid, whose control is the pressure in it."""

    number_of_turns: Annotated[float, real(domain="> 0")] = 1.5
    """Turns of a thread around the tube, from end to end."""
    thread_length: Annotated[float, real(domain="> 0")] = 200.0
    """Length of one thread of the braid, unwound."""
    cord_length: Annotated[float, real(domain=">= 0")] = 0.0
    """Length of the path that is cord and does not shorten; the tube is the rest."""
