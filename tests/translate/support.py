"""Models and records for the tests of translations."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import numpy as np

import osimlite
from osimlite.schema.joints import WeldJoint
from osimlite.schema.model import Model
from osimlite.translate.export import Urdf
from osimlite.translate.survey import CONTAINERS
from tests.io.b3d_files import make_walker
from tests.simple_models import make_single_body


def kinds(urdf: Urdf) -> dict[str, list[str]]:
    """Return the components of all records by kind of record."""
    result: dict[str, list[str]] = {}
    for record in urdf.fidelity:
        result.setdefault(record.kind, []).append(record.component)
    return result


def unaccounted(model: Model, urdf: Urdf) -> list[str]:
    paths = [
        component.path for component in model.components() if not isinstance(component, CONTAINERS)
    ]
    return urdf.fidelity.list_missing(paths)


def one_body(*shapes, joint=None, **body) -> Model:
    """Return a model of one body with these shapes, on a weld joint by default."""
    joint = joint or WeldJoint(name="weld")
    model = make_single_body(joint, name="one", body="block", mass=2.0, at=(0.0, 1.0, 0.0), **body)
    model["/bodyset/block"].attach(*shapes)
    return model


def visuals(urdf: Urdf, link: str = "block"):
    return ElementTree.fromstring(urdf.text).findall(f"link[@name='{link}']/visual")


def vertices(content: bytes):
    lines = [line.split() for line in content.decode().splitlines()]
    return np.array([[float(word) for word in line[1:]] for line in lines if line[0] == "v"])


def make_tilted() -> osimlite.Model:
    """Return a walker with a hip about an oblique axis, a marker and a muscle."""
    model = make_walker()
    function = osimlite.LinearFunction(coefficients=(1.0, 0.0))
    axis = osimlite.TransformAxis(
        name="rotation1", axis=(0.6, 0.0, -0.8), function=function, coordinates=("swing",)
    )
    tail = model.add(osimlite.Body(name="tail", mass=1.0, inertia=(1.0, 2.0, 2.5, 0.1, 0.0, 0.0)))
    joint = osimlite.CustomJoint(
        name="tail",
        coordinates=[osimlite.Coordinate(name="swing")],
        spatial_transform=osimlite.SpatialTransform(rotation1=axis),
    )
    model.add(joint.between(model["/bodyset/pelvis"], tail, at=(-0.1, 0.0, 0.0)))
    model.add(osimlite.Marker(name="tip", socket_parent_frame=tail, location=(0.1, 0.2, 0.3)))
    muscle = osimlite.Thelen2003Muscle(
        name="wagger", max_isometric_force=200.0, max_contraction_velocity=7.5
    )
    muscle.geometry_path.add_point(model["/bodyset/pelvis"], (0.0, 0.1, 0.0))
    muscle.geometry_path.add_point(model["/bodyset/pelvis"], (-0.05, 0.1, 0.0))
    muscle.geometry_path.add_point(tail, (-0.2, 0.0, 0.05))
    model.add(muscle)
    return model
