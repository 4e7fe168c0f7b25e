"""Mechanisms that are built from the cases in fixtures/kinematics without a model file."""

from __future__ import annotations

import gzip
import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import osimlite
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody import functions as f
from osimlite.mechanics.multibody.joints import (
    PLAIN_JOINTS,
    JointAxis,
    Mobilizer,
    make_custom_motions,
    make_ellipsoid_motions,
    make_plain_motions,
    make_scapulothoracic_motions,
    motion_types,
)
from osimlite.mechanics.multibody.mechanism import (
    CoordinateInfo,
    MassProperties,
    Mechanism,
    MobileBody,
)
from osimlite.mechanics.multibody.motions import JointMotion
from osimlite.mechanics.multibody.schema_functions import convert_function
from osimlite.mechanics.multibody.spatial import make_offset
from osimlite.schema import functions as schema

MOTIONS = {name: make_plain_motions(getattr(osimlite, name)) for name in PLAIN_JOINTS}


FIXTURES = Path(__file__).parents[3] / "fixtures" / "kinematics"


@cache
def load(name: str) -> Any:
    """Read a JSON fixture, compressed or not."""
    packed = FIXTURES / f"{name}.gz"
    if packed.exists():
        return json.loads(gzip.decompress(packed.read_bytes()))
    return json.loads((FIXTURES / name).read_text())


def function(spec: dict[str, Any]) -> f.SmoothFunction:
    """Return the function that a case describes."""
    return convert_function(_component(spec), 1, "the function of a case")


def _component(spec: dict[str, Any]) -> schema.Function:
    fields = {
        name: tuple(value) if isinstance(value, list) else value for name, value in spec.items()
    }
    kind = getattr(osimlite, str(fields.pop("type")))
    if "function" in fields:
        fields["function"] = _component(spec["function"])
    component: schema.Function = kind(**fields)
    return component


def motions(joint_type: str, properties: dict[str, Any]) -> tuple[JointMotion, ...]:
    """Return the motions of a joint.

    Args:
        joint_type: class of the joint.
        properties: its properties in a case.
    """
    match joint_type:
        case "EllipsoidJoint":
            return make_ellipsoid_motions(properties["radii_x_y_z"])
        case "ScapulothoracicJoint":
            return make_scapulothoracic_motions(
                properties["thoracic_ellipsoid_radii_x_y_z"],
                properties["scapula_winging_axis_origin"],
                properties["scapula_winging_axis_direction"],
            )
        case "CustomJoint":
            names = properties["coordinate_order"]
            axes = [
                JointAxis(
                    tuple(names.index(name) for name in axis["coordinates"]),
                    axis["axis"],
                    function(axis["function"]),
                )
                for axis in properties["axes"]
            ]
            return make_custom_motions(axes[:3], axes[3:])
    return MOTIONS[joint_type]


def mechanism_of(case: dict[str, Any], *, turned_round: bool = False) -> Mechanism:
    """Build the mechanism of a case of joint_kinematics_cases.json: ground and one body, which is the child.

    Args:
        case: the case.
        turned_round: the body is the joint's parent and ground its child.
    """
    parts = motions(case["joint_type"], case["properties"])
    count = len(case["coordinates"])
    types = motion_types(parts, count)
    mobilizer = Mobilizer(
        joint="/jointset/j",
        joint_type=case["joint_type"],
        motions=parts,
        coordinates=tuple(range(count)),
        parent_frame=make_offset(**case["parent_offset"]),
        child_frame=make_offset(**case["child_offset"]),
        reversed=turned_round,
    )
    coordinates = tuple(
        CoordinateInfo(item["name"], f"/jointset/j/{item['name']}", "/jointset/j", types[index])
        for index, item in enumerate(case["coordinates"])
    )
    properties = MassProperties(1.3, np.array((0.1, -0.2, 0.05)), np.diag((0.3, 0.4, 0.5)))
    body = MobileBody("C", "/bodyset/C", -1, properties, mobilizer)
    return Mechanism("case", (body,), coordinates)


def alone(mobilizer: Mobilizer) -> Mechanism:
    """Return a mechanism of ground and one body that a joint carries."""
    names = [f"q{k}" for k in mobilizer.coordinates]
    infos = tuple(
        CoordinateInfo(name, f"{mobilizer.joint}/{name}", mobilizer.joint, "coupled")
        for name in names
    )
    return Mechanism(
        "alone", (MobileBody("C", "/bodyset/C", -1, MassProperties(1.0), mobilizer),), infos
    )


@cache
def mixed_tree() -> Mechanism:
    """Return the tree of fixtures/kinematics/mixed_joint_tree.osim: 10 bodies, 24 coordinates, 10 joint types."""
    return build_mechanism(osimlite.read(FIXTURES / "mixed_joint_tree.osim"))
