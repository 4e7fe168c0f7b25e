"""Tests of tendons that approximate what MuJoCo lacks: ellipsoids, tori, moving points, several surfaces."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.mechanics.multibody.functions import Polynomial, SineWave
from osimlite.schema.frames import Body
from osimlite.schema.joints import PinJoint
from osimlite.schema.model import Model
from osimlite.schema.muscles import PathActuator
from osimlite.schema.paths import GeometryPath, PathPoint, PathWrap
from osimlite.schema.wrap_types import WrapCylinder, WrapEllipsoid, WrapTorus
from osimlite.translate.mjcf.fits import fit_tendon
from osimlite.translate.mjcf.moving import fit_composition
from osimlite.translate.mjcf.poses import draw_poses
from osimlite.translate.mjcf.routes import Router
from osimlite.translate.mjcf.tendons import TendonSite, WrapGeom


def joint_with(surface):
    """Return two bodies on a pin, and a muscle between them that wraps around a surface at the pin."""
    model = Model(name="joint")
    body = model.add(Body(name="arm", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    pin = PinJoint(name="pin")
    pin.coordinates[0].name = "angle"
    pin.coordinates[0].range = (-1.5, 0.5)
    model.add(pin.between(model.ground, body))
    surface.name = "surface"
    body.WrapObjectSet.objects.append(surface)
    path = GeometryPath(name="path")
    for name, frame, place in (
        ("a", "/ground", (0.03, 0.3, 0.01)),
        ("b", "/bodyset/arm", (0.05, -0.3, 0.0)),
    ):
        path.path_point_set.objects.append(
            PathPoint(name=name, socket_parent_frame=frame, location=place)
        )
    path.path_wrap_set.objects.append(PathWrap(name="wrap", wrap_object="surface"))
    model.add(PathActuator(name="cable", geometry_path=path))
    return model


def router(model, version=4):
    paths = osimlite.paths(model)
    poses, truth = draw_poses(paths, 80, 0)
    return Router(paths.routes["/forceset/cable"], truth["/forceset/cable"], poses, version)


@pytest.mark.parametrize("version", [3, 4])
def test_a_cylinder_that_is_crossed_squarely_is_exact(version):
    model = joint_with(WrapCylinder(radius=0.1, length=0.5, quadrant="x"))
    for point in model["/forceset/cable"].geometry_path.path_point_set.objects:
        x, y, _ = point.location
        point.location = (x, y, 0.02)
    way = router(model, version)
    assert 20 < len(way.contacts[0].poses) < 80
    tendon = way.find_best()
    assert [type(part) for part in tendon] == [TendonSite, WrapGeom, TendonSite]
    assert way.compute_error(tendon) < 1e-12


@pytest.mark.parametrize(
    ("surface", "chosen", "after"),
    [
        (
            WrapEllipsoid(dimensions=(0.06, 0.1, 0.15), quadrant="x", translation=(0.02, 0.0, 0.0)),
            0.02,
            0.003,
        ),
        (
            WrapTorus(inner_radius=0.02, outer_radius=0.06, xyz_body_rotation=(1.5, 0.0, 0.0)),
            0.02,
            0.01,
        ),
    ],
)
def test_what_mujoco_has_not_is_near_and_nearer_if_fitted(surface, chosen, after):
    way = router(joint_with(surface))
    assert len(way.contacts[0].poses) > 10
    tendon = way.find_best()
    before = way.compute_error(tendon)
    assert before < chosen
    assert way.compute_error(fit_tendon(way, tendon)) < min(after, 0.9 * before)


def test_a_quartic_of_a_quartic():
    functions = (SineWave(0.03, 1.5, 0.2, 0.1), Polynomial((0.1, 0.0, 0.2)))
    drive, slides = fit_composition(functions, (-2.0, 0.2))
    x = np.linspace(-2.0, 0.2, 50)
    helper = np.polynomial.polynomial.polyval(x, drive)
    for function, row in zip(functions, slides, strict=True):
        wanted = [function.derivatives(value)[0] for value in x]
        np.testing.assert_allclose(np.polynomial.polynomial.polyval(helper, row), wanted, atol=2e-4)
    drive, slides = fit_composition(functions[1:], (-2.0, 0.2))
    assert drive.tolist() == [0.0, 1.0, 0.0, 0.0, 0.0] and slides.tolist() == [
        [0.2, 0.0, 0.1, 0.0, 0.0]
    ]
