"""Mechanisms built from the cases in fixtures/kinematics, without any document in between."""

from __future__ import annotations

import gzip
import json
import xml.etree.ElementTree as ElementTree
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.multibody import functions as f
from osimlite.multibody.joints import (
    MOTIONS,
    Mobilizer,
    TransformAxis,
    custom,
    ellipsoid,
    motion_types,
    scapulothoracic,
)
from osimlite.multibody.mechanism import CoordinateInfo, MassProperties, Mechanism, MobileBody
from osimlite.multibody.motions import Motion
from osimlite.multibody.spatial import offset

FIXTURES = Path(__file__).parents[2] / "fixtures" / "kinematics"


@cache
def load(name: str) -> Any:
    """A JSON fixture, packed or not."""
    packed = FIXTURES / f"{name}.gz"
    if packed.exists():
        return json.loads(gzip.decompress(packed.read_bytes()))
    return json.loads((FIXTURES / name).read_text())


def function(spec: dict[str, Any]) -> f.Function:
    """The function that a case describes."""
    match spec["type"]:
        case "Constant":
            return f.Constant(spec["value"])
        case "LinearFunction":
            return f.Linear(*spec["coefficients"])
        case "PolynomialFunction":
            return f.Polynomial(tuple(spec["coefficients"]))
        case "SimmSpline":
            return f.SimmSpline(spec["x"], spec["y"])
        case "PiecewiseLinearFunction":
            return f.PiecewiseLinear(tuple(spec["x"]), tuple(spec["y"]))
        case "PiecewiseConstantFunction":
            return f.PiecewiseConstant(tuple(spec["x"]), tuple(spec["y"]))
        case "MultiplierFunction":
            return f.Scaled(spec["scale"], function(spec["function"]))
        case "Sine":
            return f.Sine(spec["amplitude"], spec["omega"], spec["phase"], spec["offset"])
    raise AssertionError(spec["type"])


def motions(joint_type: str, properties: dict[str, Any]) -> tuple[Motion, ...]:
    """The motions of a joint with the properties that a case gives."""
    match joint_type:
        case "EllipsoidJoint":
            return ellipsoid(properties["radii_x_y_z"])
        case "ScapulothoracicJoint":
            return scapulothoracic(
                properties["thoracic_ellipsoid_radii_x_y_z"],
                properties["scapula_winging_axis_origin"],
                properties["scapula_winging_axis_direction"],
            )
        case "CustomJoint":
            names = properties["coordinate_order"]
            axes = [
                TransformAxis(
                    tuple(names.index(name) for name in axis["coordinates"]),
                    axis["axis"],
                    function(axis["function"]),
                )
                for axis in properties["axes"]
            ]
            return custom(axes[:3], axes[3:])
    return MOTIONS[joint_type]


def mechanism_of(case: dict[str, Any], *, turned_round: bool = False) -> Mechanism:
    """Ground and one body, joined as a case of joint_kinematics_cases.json says; the body is the child.

    With `turned_round` the body is the joint's parent and ground its child.
    """
    parts = motions(case["joint_type"], case["properties"])
    count = len(case["coordinates"])
    types = motion_types(parts, count)
    mobilizer = Mobilizer(
        joint="/jointset/j",
        joint_type=case["joint_type"],
        motions=parts,
        coordinates=tuple(range(count)),
        parent_frame=offset(**case["parent_offset"]),
        child_frame=offset(**case["child_offset"]),
        reversed=turned_round,
    )
    coordinates = tuple(
        CoordinateInfo(item["name"], f"/jointset/j/{item['name']}", "/jointset/j", types[index])
        for index, item in enumerate(case["coordinates"])
    )
    properties = MassProperties(1.3, np.array((0.1, -0.2, 0.05)), np.diag((0.3, 0.4, 0.5)))
    body = MobileBody("C", "/bodyset/C", -1, properties, mobilizer)
    return Mechanism("case", (body,), coordinates)


def _numbers(element: ElementTree.Element, tag: str) -> list[float]:
    return [float(word) for word in (element.findtext(tag) or "").split()]


def _inertia(values: list[float]) -> Any:
    xx, yy, zz, xy, xz, yz = values
    return np.array(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))


def _function_spec(element: ElementTree.Element) -> dict[str, Any]:
    spec: dict[str, Any] = {"type": element.tag}
    for child in element:
        values = _numbers(element, child.tag)
        spec[child.tag] = values[0] if child.tag == "value" else values
    return spec


def _joint_properties(joint: ElementTree.Element, names: list[str]) -> dict[str, Any]:
    if joint.tag == "EllipsoidJoint":
        return {"radii_x_y_z": _numbers(joint, "radii_x_y_z")}
    axes = [
        {
            "coordinates": (axis.findtext("coordinates") or "").split(),
            "axis": _numbers(axis, "axis"),
            "function": _function_spec(axis[-1]),
        }
        for axis in joint.iterfind("SpatialTransform/TransformAxis")
    ]
    return {"axes": axes, "coordinate_order": names}


@cache
def mixed_tree() -> Mechanism:
    """The tree of fixtures/kinematics/mixed_joint_tree.osim: 10 bodies, 24 coordinates, 10 joint types."""
    model = ElementTree.parse(FIXTURES / "mixed_joint_tree.osim").getroot()[0]
    elements = {body.get("name"): body for body in model.iterfind("BodySet/objects/Body")}
    order: dict[str, int] = {}
    bodies: list[MobileBody] = []
    coordinates: list[CoordinateInfo] = []
    for joint in model.iterfind("JointSet/objects/*"):
        names = [str(item.get("name")) for item in joint.iterfind("coordinates/Coordinate")]
        parts = motions(joint.tag, _joint_properties(joint, names))
        types = motion_types(parts, len(names))
        path = f"/jointset/{joint.get('name')}"
        (parent, parent_frame), (child, child_frame) = (
            (
                (frame.findtext("socket_parent") or "").split("/")[-1],
                offset(_numbers(frame, "translation"), _numbers(frame, "orientation")),
            )
            for frame in joint.iterfind("frames/PhysicalOffsetFrame")
        )
        own = tuple(range(len(coordinates), len(coordinates) + len(names)))
        coordinates += [CoordinateInfo(name, f"{path}/{name}", path, types[i]) for i, name in enumerate(names)]
        element = elements[child]
        properties = MassProperties(
            _numbers(element, "mass")[0],
            np.array(_numbers(element, "mass_center")),
            _inertia(_numbers(element, "inertia")),
        )
        mobilizer = Mobilizer(path, joint.tag, parts, own, parent_frame, child_frame)
        bodies.append(MobileBody(child, f"/bodyset/{child}", order.get(parent, -1), properties, mobilizer))
        order[child] = len(bodies) - 1
    return Mechanism("mixed_joint_tree", tuple(bodies), tuple(coordinates), np.array(_numbers(model, "gravity")))
