"""Check Nimble's interpretation of a model: its joints, and the order of its degrees of freedom."""

from __future__ import annotations

import pytest

import osimlite
from osimlite.io.nimble import NimbleJoint, classify_custom_joint, count_dofs, list_coordinates
from tests.io.b3d_files import NIMBLE_ORDER, make_walker

LINE = osimlite.LinearFunction(coefficients=(1.0, 0.0))
ZERO = osimlite.Constant(value=0.0)
HALF = osimlite.Constant(value=0.5)
CURVE = osimlite.PolynomialFunction(coefficients=(1.0, 0.0))
PLACES = ("rotation1", "rotation2", "rotation3", "translation1", "translation2", "translation3")


def make_joint(functions: list[osimlite.Function], count: int) -> osimlite.CustomJoint:
    axes = {
        place: osimlite.TransformAxis(name=place, function=function)
        for place, function in zip(PLACES, functions, strict=True)
    }
    coordinates = [osimlite.Coordinate(name=f"q{index}") for index in range(count)]
    transform = osimlite.SpatialTransform(**axes)
    return osimlite.CustomJoint(name="it", coordinates=coordinates, spatial_transform=transform)


@pytest.mark.parametrize(
    ("functions", "count", "kind", "dofs"),
    [
        ([ZERO] * 6, 1, NimbleJoint.WELD, 0),
        ([LINE] * 6, 6, NimbleJoint.EULER_FREE, 6),
        ([LINE] * 3 + [HALF] * 3, 3, NimbleJoint.EULER, 3),
        ([LINE] * 4 + [ZERO] * 2, 6, NimbleJoint.EULER, 3),
        ([LINE] + [HALF] * 5, 1, NimbleJoint.REVOLUTE, 1),
        ([ZERO] * 4 + [LINE, ZERO], 1, NimbleJoint.PRISMATIC, 1),
        ([LINE, ZERO, LINE] + [ZERO] * 3, 2, NimbleJoint.UNIVERSAL, 2),
        ([LINE, ZERO, ZERO, LINE, ZERO, ZERO], 2, NimbleJoint.CUSTOM, 2),
        ([CURVE] + [ZERO] * 5, 1, NimbleJoint.CUSTOM, 1),
        ([HALF] + [ZERO] * 5, 1, NimbleJoint.CUSTOM, 1),
        (
            [osimlite.MultiplierFunction(function=LINE, scale=2.0)] + [ZERO] * 5,
            1,
            NimbleJoint.REVOLUTE,
            1,
        ),
    ],
)
def test_the_joint_that_nimble_makes(
    functions: list[osimlite.Function], count: int, kind: NimbleJoint, dofs: int
) -> None:
    joint = make_joint(functions, count)
    assert classify_custom_joint(joint) is kind and count_dofs(joint) == dofs


def test_legs_follow_each_other_and_patellae_are_left_out() -> None:
    model = make_walker()
    assert [each.name for each in model.components(osimlite.Coordinate)] != list(NIMBLE_ORDER)
    assert [each.name for each in list_coordinates(model)] == list(NIMBLE_ORDER)


def test_only_the_largest_tree_is_read() -> None:
    model = make_walker()
    lone = model.add(osimlite.Body(name="ball", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    model.add(osimlite.PinJoint(name="spin").between(model.ground, lone))
    assert [each.name for each in list_coordinates(model)] == list(NIMBLE_ORDER)


def test_a_socket_that_leads_nowhere_hides_its_joint_only() -> None:
    model = make_walker()
    joint = model["/jointset/mtp_r"]
    joint.socket_child_frame = "/bodyset/gone"
    assert "mtp_r_angle" not in [each.name for each in list_coordinates(model)]


def test_files_of_opensim_3_keep_the_order_of_their_bodies() -> None:
    def write_body(name: str, parent: str) -> str:
        return f"""<Body name="{name}"><mass>1</mass><mass_center>0 0 0</mass_center><inertia_xx>1</inertia_xx>
<inertia_yy>1</inertia_yy><inertia_zz>1</inertia_zz><Joint><PinJoint name="to_{name}">
<parent_body>{parent}</parent_body><location_in_parent>0 0 0</location_in_parent>
<orientation_in_parent>0 0 0</orientation_in_parent><location>0 0 0</location><orientation>0 0 0</orientation>
<CoordinateSet><objects><Coordinate name="q_{name}"/></objects></CoordinateSet></PinJoint></Joint></Body>"""

    tree = {
        "pelvis": "ground",
        "leg_r": "pelvis",
        "leg_l": "pelvis",
        "foot_r": "leg_r",
        "foot_l": "leg_l",
    }
    bodies = "".join(write_body(name, parent) for name, parent in tree.items())
    text = (
        '<OpenSimDocument Version="30000"><Model name="m"><BodySet><objects><Body name="ground"/>'
        f"{bodies}</objects></BodySet></Model></OpenSimDocument>"
    )
    model = osimlite.read_text(text)
    assert [each.name for each in list_coordinates(model)] == [f"q_{name}" for name in tree]
    # In the present format the second leg follows the first.
    again = osimlite.read_text(osimlite.to_text(model))
    legs = ["pelvis", "leg_r", "foot_r", "leg_l", "foot_l"]
    assert [each.name for each in list_coordinates(again)] == [f"q_{name}" for name in legs]
