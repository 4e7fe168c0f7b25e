from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.errors import OsimliteError
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.multibody import build_mechanism
from osimlite.schema.geometry import Cylinder
from osimlite.view.scene import Scene, hull

coordinates = st.floats(-10.0, 10.0)


@given(st.lists(st.tuples(coordinates, coordinates), min_size=3, max_size=30))
def test_a_hull_is_convex_and_holds_all_points(points):
    corners = hull(np.array(points))
    assert {tuple(corner) for corner in corners.tolist()} <= set(points)
    if len(corners) < 3:
        return
    edges = np.roll(corners, -1, axis=0) - corners
    for point in np.array(points):
        inside = edges[:, 0] * (point - corners)[:, 1] - edges[:, 1] * (point - corners)[:, 0]
        assert inside.min() > -1e-9


def test_a_hull_has_no_points_inside():
    square = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]
    assert {tuple(corner) for corner in hull(np.array([*square, (1.0, 1.0), (1.0, 0.0)])).tolist()} == set(square)


def scene(plane="xy"):
    model = dynamic_walker()
    mechanism = build_mechanism(model)
    return Scene(model, mechanism, plane), mechanism


def seen(plane, body):
    """Silhouette (k, 2) of the shape of a body at the default pose with leg and platform upright, and its origin."""
    picture, mechanism = scene(plane)
    pose = picture.at(mechanism.values({"platform_rz": 0.0, "RHip_rz": 0.0}))
    (outline,) = [item for item in picture.outlines if mechanism.bodies[item.body].name == body]
    return picture.silhouette(pose, outline), picture.flat(pose.origins[outline.body][None, :])[0]


@pytest.mark.parametrize("plane", ["xy", "yz", "xz"])
def test_a_ball_is_round_from_every_side(plane):
    corners, center = seen(plane, "Pelvis")
    assert len(corners) == 64
    assert np.abs(np.linalg.norm(corners - center, axis=1) - 0.2).max() < 1e-12


@pytest.mark.parametrize(("plane", "size"), [("xy", (0.08, 0.4)), ("yz", (0.08, 0.4)), ("xz", (0.08, 0.08))])
def test_an_ellipsoid_has_its_size_from_every_side(plane, size):
    flat, _ = seen(plane, "RightThigh")
    assert np.ptp(flat, axis=0) == pytest.approx(size, abs=2e-3)


def test_the_viewer_stands_where_the_plane_says():
    for plane, right, up, towards in (
        ("xy", (1, 0, 0), (0, 1, 0), (0, 0, 1)),
        ("yz", (0, 0, -1), (0, 1, 0), (1, 0, 0)),
        ("xz", (1, 0, 0), (0, 0, -1), (0, 1, 0)),
    ):
        picture, _ = scene(plane)
        assert (picture.right == right).all() and (picture.up == up).all() and (picture.towards == towards).all()
    with pytest.raises(OsimliteError, match="not 'zx'"):
        scene("zx")


def test_contacts_are_found_with_what_they_meet():
    picture, mechanism = scene()
    assert len(picture.discs) == 6 and len(picture.planes) == 1 and len(picture.pushes) == 6
    foot = next(push for push in picture.pushes if push.element == "LFootForce")
    assert (foot.sphere.name, foot.sphere.frame, foot.sphere.radius) == ("LFootContact", "LeftShank", 0.05)
    assert foot.sphere.center.tolist() == [0.0, -0.2175, 0.0]
    assert foot.ground is not None and mechanism.bodies[foot.ground.body].name == "Platform"
    assert np.abs(-foot.ground.matrix[:3, 0] - (0.0, 1.0, 0.0)).max() < 1e-3


def test_a_cylinder_stands_along_y():
    model = dynamic_walker()
    pelvis = model.body_set.objects[1]
    del pelvis.attached_geometry[:]
    pelvis.attach(Cylinder(radius=0.1, half_height=0.3))
    mechanism = build_mechanism(model)
    (outline,) = [item for item in Scene(model, mechanism).outlines if mechanism.bodies[item.body].name == "Pelvis"]
    assert np.ptp(outline.points, axis=0) == pytest.approx((0.2, 0.6, 0.2), abs=1e-9)


def test_sticks_join_the_joints():
    picture, mechanism = scene()
    pose = picture.at(mechanism.values({}))
    lines = {mechanism.bodies[body].name: ends for body, ends in picture.sticks(pose)}
    thigh = lines["RightThigh"][0]
    assert np.linalg.norm(thigh[1] - thigh[0]) == pytest.approx(0.4)
    # The last body of a limb ends at its mass centre.
    shank = lines["RightShank"][0]
    assert np.linalg.norm(shank[1] - shank[0]) == pytest.approx(0.2175)
    assert shank[0] == pytest.approx(thigh[1])
