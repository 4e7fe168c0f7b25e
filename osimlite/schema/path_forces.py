"""Springs and ligaments along a path: they pull without a control."""

import math
from functools import partial
from typing import Annotated

from pydantic import Field

from osimlite.schema.base import make_default
from osimlite.schema.default_curves import make_passive_force_length
from osimlite.schema.facts import (
    NAN,
    PATH,
    STOPS,
    Facts,
)
from osimlite.schema.fields import Flag, Number, Single, Tag, Text, real
from osimlite.schema.forces import ForceProducer
from osimlite.schema.functions import Function
from osimlite.schema.geometry import Appearance
from osimlite.schema.muscles import PathActuator
from osimlite.schema.paths import AbstractGeometryPath, GeometryPath


def _make_green_appearance() -> Appearance:
    return Appearance.build({"color": (0.0, 1.0, 0.0)}, set())


class PathSpring(ForceProducer):
    """A spring along a path that pulls and never pushes; damping grows with its tension."""

    facts = Facts(
        outputs="length lengthening_speed stretch tension",
        refused="resting_length stiffness dissipation",
        scales={"resting_length": PATH},
    )

    geometry_path: Annotated[Single[AbstractGeometryPath], Tag("path")] = make_default(
        GeometryPath, name="path", appearance=_make_green_appearance
    )
    """The line along which the spring pulls."""
    resting_length: Annotated[float, real("m", ">= 0")] = math.nan
    """Length of the path up to which the spring is slack."""
    stiffness: Annotated[float, real("N/m", ">= 0")] = math.nan
    """Tension per stretch beyond the resting length."""
    dissipation: Annotated[float, real("s/m", ">= 0")] = math.nan
    """Coefficient c of the factor 1 + c v of the tension, at the lengthening velocity v."""


class ExpressionBasedPathForce(ForceProducer):
    """A tension by a formula in the path's stretch `s` and its lengthening speed `ldot`."""

    facts = Facts(
        outputs="length lengthening_speed stretch tension", scales={"resting_length": PATH}
    )

    geometry_path: Annotated[Single[AbstractGeometryPath], Tag("path")] = make_default(
        GeometryPath, name="path", appearance=_make_green_appearance
    )
    """The line along which the force pulls."""
    resting_length: Annotated[float, real("m", ">= 0")] = 0.0
    """Length of the path from which the stretch `s` counts."""
    expression: Text = "0.0"
    """Formula of the tension in `s` and `ldot`."""
    clamp_stretch: Flag = True
    """Whether `s` is 0 where the path is shorter than its resting length, instead of negative."""


class Ligament(ForceProducer):
    """A ligament: `pcsa_force` times a curve of its length over `resting_length`."""

    facts = Facts(
        domains={"resting_length": "> 0"},
        zero={NAN: "resting_length"},
        scales={"resting_length": PATH},
    )

    geometry_path: Annotated[Single[AbstractGeometryPath], Tag("path")] = make_default(
        GeometryPath, name="path"
    )
    """The line along which the ligament pulls."""
    resting_length: Annotated[float, real("m", ">= 0")] = 0.0
    """Length of the path up to which the ligament is slack."""
    pcsa_force: Annotated[float, real("N", ">= 0")] = 0.0
    """Factor of the curve, from the cross-section of the ligament."""
    force_length_curve: Single[Function] = Field(
        default_factory=partial(make_passive_force_length, "force_length_curve")
    )
    """Tension over `pcsa_force`, as a function of length over resting length."""


class Blankevoort1991Ligament(ForceProducer):
    """A ligament whose force rises as the square of strain, and linearly beyond `transition_strain`."""

    facts = Facts(
        outputs="damping_force length lengthening_speed spring_force strain strain_rate total_force",
        domains={"slack_length": "> 0"},
        refused="slack_length linear_stiffness transition_strain damping_coefficient",
        zero={NAN: "slack_length"},
        scales={"slack_length": PATH},
    )

    geometry_path: Annotated[Single[AbstractGeometryPath], Tag("path")] = make_default(
        GeometryPath, name="path"
    )
    """The line along which the ligament pulls."""
    linear_stiffness: Annotated[float, real("N", ">= 0")] = 1.0
    """Tension per strain beyond the transition."""
    transition_strain: Annotated[float, real("strain", ">= 0")] = 0.06
    """Strain at which the tension changes from a quadratic to a linear rise."""
    damping_coefficient: Annotated[float, real("N*s/strain", ">= 0")] = 0.003
    """Tension per rate of strain, only while the ligament is taut and lengthens."""
    slack_length: Annotated[float, real("m", ">= 0")] = 0.0
    """Length of the path up to which there is no tension; strain counts from it."""


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
    """Coefficient c of the factor 1 + c v of the tension, at the lengthening velocity v."""
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
