"""Springs and ligaments along a path: they pull without a control."""

import math
from functools import partial
from typing import Annotated

from pydantic import Field

from osimlite.schema.base import made
from osimlite.schema.default_curves import passive_force_length
from osimlite.schema.fields import Flag, Single, Tag, Text, real
from osimlite.schema.forces import ForceProducer
from osimlite.schema.functions import Function
from osimlite.schema.geometry import Appearance
from osimlite.schema.paths import AbstractGeometryPath, GeometryPath


def _green() -> Appearance:
    return Appearance.build({"color": (0.0, 1.0, 0.0)}, set())


class PathSpring(ForceProducer):
    """A spring along a path that pulls and never pushes; damping grows with its tension."""

    geometry_path: Annotated[Single[AbstractGeometryPath], Tag("path")] = made(
        GeometryPath, name="path", appearance=_green
    )
    resting_length: Annotated[float, real("m", ">= 0")] = math.nan
    stiffness: Annotated[float, real("N/m", ">= 0")] = math.nan
    dissipation: Annotated[float, real("s/m", ">= 0")] = math.nan


class ExpressionBasedPathForce(ForceProducer):
    """A tension by a formula in the path's stretch `s` and its lengthening speed `ldot`."""

    geometry_path: Annotated[Single[AbstractGeometryPath], Tag("path")] = made(
        GeometryPath, name="path", appearance=_green
    )
    resting_length: Annotated[float, real("m", ">= 0")] = 0.0
    expression: Text = "0.0"
    clamp_stretch: Flag = True


class Ligament(ForceProducer):
    """A ligament: `pcsa_force` times a curve of its length over `resting_length`."""

    geometry_path: Annotated[Single[AbstractGeometryPath], Tag("path")] = made(GeometryPath, name="path")
    resting_length: Annotated[float, real("m", ">= 0")] = 0.0
    pcsa_force: Annotated[float, real("N", ">= 0")] = 0.0
    force_length_curve: Single[Function] = Field(default_factory=partial(passive_force_length, "force_length_curve"))


class Blankevoort1991Ligament(ForceProducer):
    """A ligament whose force rises as the square of strain, and linearly beyond `transition_strain`."""

    geometry_path: Annotated[Single[AbstractGeometryPath], Tag("path")] = made(GeometryPath, name="path")
    linear_stiffness: Annotated[float, real("N", ">= 0")] = 1.0
    transition_strain: Annotated[float, real("strain", ">= 0")] = 0.06
    damping_coefficient: Annotated[float, real("N*s/strain", ">= 0")] = 0.003
    slack_length: Annotated[float, real("m", ">= 0")] = 0.0
