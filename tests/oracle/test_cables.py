"""Compare paths over obstacles (Scholz2015GeometryPath) with a live OpenSim 4.6."""

from __future__ import annotations

from math import nan

import numpy as np
import pytest

import osimlite
from osimlite import Body, ContactSphere, Coordinate, Model
from osimlite.errors import ModelError, UnsupportedError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.schema.contact_types import ContactCylinder, ContactEllipsoid, ContactTorus
from osimlite.schema.frames import PhysicalOffsetFrame
from osimlite.schema.path_forces import PathSpring
from osimlite.schema.paths import PathPoint
from osimlite.schema.scholz_paths import (
    Scholz2015GeometryPath,
    Scholz2015GeometryPathObstacle,
    Scholz2015GeometryPathPoint,
)
from osimlite.simulation.elements import force_elements
from osimlite.simulation.engines.compiled import CompiledEngine

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

from tests.oracle.opensim_runs import put  # noqa: E402

GROUND, B0, B1, B2, F1 = "/ground", "/bodyset/b0", "/bodyset/b1", "/bodyset/b2", "/bodyset/b1/f1"
SURFACES = {
    "sphere": ContactSphere(radius=0.05),
    "cylinder": ContactCylinder(radius=0.05, orientation=(0.2, 0.1, 0.3)),
    "ellipsoid": ContactEllipsoid(radii=(0.04, 0.06, 0.05), orientation=(0.2, 0.1, 0.3)),
    "torus": ContactTorus(torus_radius=0.08, tube_radius=0.03, orientation=(1.3, 0.2, 0.1)),
}


def at(frame, *location):
    return frame, location


def over(kind, frame, *location, hint=(nan, nan, nan)):
    """Return an obstacle as the tuple that `carrier` expects."""
    return kind, frame, location, hint


# Ends of paths.
HIGH, LOW, END = at(GROUND, -0.1, 0.1, 0), at(GROUND, -0.1, 0.03, 0.01), at(B2, 0, 0.02, 0)
UP = {"hint": (0, 0.1, 0)}
# Elements of each path: points and obstacles.
PATHS = {
    "straight": (
        at(GROUND, 0.1, 0.1, 0),
        at(B1, 0.1, 0, 0.05),
        at(F1, 0.02, 0.0, 0.01),
        at(B2, 0.1, -0.1, 0),
    ),
    "over a sphere": (HIGH, over("sphere", B0, 0.1, 0, 0, hint=(0.01, 0.08, 0.01)), END),
    "over a cylinder": (HIGH, over("cylinder", B0, 0.1, 0, 0, hint=(0.01, 0.08, 0.01)), END),
    "over an ellipsoid": (HIGH, over("ellipsoid", B0, 0.1, 0, 0, hint=(0.01, 0.08, 0.01)), END),
    "over a torus": (HIGH, over("torus", B0, 0.1, -0.08, 0, hint=(0.08, 0, 0.03)), END),
    **{
        f"over a {kind} without a hint": (LOW, over(kind, B0, 0.1, 0, 0.01), END)
        for kind in SURFACES
    },
    "beside a sphere": (HIGH, over("sphere", B0, 0.1, -0.1, 0, **UP), at(B2, 0, 0.1, 0)),
    "over several": (
        *(at(GROUND, -0.1, 0.05, 0), over("sphere", B0, 0, 0, 0, **UP), at(B0, 0.1, 0.12, 0.01)),
        *(over("cylinder", B0, 0.17, 0, 0.01, **UP), over("ellipsoid", B1, 0.1, 0, 0, **UP)),
        *(over("sphere", B1, 0.1, 0.3, 0), at(B2, 0.1, -0.1, 0)),
    ),
    "in frames of bodies": (
        *(at(F1, -0.3, 0.05, 0.02), over("sphere", F1, 0, 0, 0, **UP), at(F1, 0.1, 0.1, 0.0)),
        *(over("ellipsoid", B2, 0, 0.0, 0, **UP), at(B2, 0.1, 0.03, 0.02)),
    ),
}


def carrier(elements):
    """Return a chain of three bodies and a spring along a path with the given elements."""
    model, body = Model(name="cables"), None
    for number in range(3):
        below, body = (
            body or model.ground,
            Body(name=f"b{number}", mass=1.0, inertia=(0.1, 0.2, 0.3, 0, 0, 0)),
        )
        if number == 1:
            frame = PhysicalOffsetFrame(
                name="f1", socket_parent="..", translation=(0.02, -0.03, 0.05)
            )
            frame.orientation = (0.1, 0.3, 0.0)
            body.subcomponents.append(frame)
        model.add(body)
        coordinate = Coordinate(name=f"q{number}", range=(-3, 3), default_value=0.1 * number)
        joint = osimlite.PinJoint(name=f"j{number}", coordinates=[coordinate])
        model.add(
            joint.between(
                below, body, at=(0.2 * (number > 0), 0, 0), turned=(0.3 - 0.2 * number, 0.1, 0)
            )
        )
    path = Scholz2015GeometryPath(name="path")
    for number, (first, *rest) in enumerate(elements):
        if first in SURFACES:
            frame, location, hint = rest
            place = {"name": f"o{number}", "socket_frame": frame, "location": location}
            model.add(SURFACES[first].model_copy(update=place))
            surface = f"/contactgeometryset/o{number}"
            element = Scholz2015GeometryPathObstacle(
                socket_contact_geometry=surface, contact_hint=hint
            )
        else:
            point = PathPoint(name="point", socket_parent_frame=first, location=rest[0])
            element = Scholz2015GeometryPathPoint(path_point=point)
        element.name = f"e{number}"
        path.path_elements.append(element)
    spring = PathSpring(name="spring", resting_length=0.1, stiffness=30.0, dissipation=0.1)
    spring.geometry_path = path
    model.add(spring)
    return model


@pytest.mark.parametrize("elements", PATHS.values(), ids=PATHS)
def test_cable(elements, tmp_path):
    """Compare four random poses, each with a fresh OpenSim model.

    OpenSim starts each search for a path from the path that it found last, so its result depends on
    the previous poses.
    """
    opensim.Logger.setLevelString("off")
    model, file = carrier(elements), tmp_path / "model.osim"
    osimlite.write(model, file)
    paths, mechanism = osimlite.paths(model), build_mechanism(model)
    engine = CompiledEngine(mechanism, force_elements(model, mechanism))
    rng = np.random.default_rng(5)
    for _ in range(4):
        q, u = rng.uniform(-0.25, 0.35, 3), rng.uniform(-2.0, 2.0, 3)
        theirs = opensim.Model(str(file))
        state = theirs.initSystem()
        coordinates = [theirs.getCoordinateSet().get(name) for name in mechanism.coordinate_names]
        put(coordinates, state, q, u)
        theirs.realizeAcceleration(state)
        path = opensim.PathSpring.safeDownCast(theirs.getForceSet().get(0)).getPath()
        name = "/forceset/spring"
        assert paths.lengths(q)[name] == pytest.approx(path.getLength(state), rel=0, abs=1e-12)
        assert paths.speeds(q, u)[name] == pytest.approx(
            path.getLengtheningSpeed(state), rel=0, abs=1e-9
        )
        expected = [coordinate.getAccelerationValue(state) for coordinate in coordinates]
        assert engine.compute_accelerations(0.0, q.tolist(), u.tolist()) == pytest.approx(
            expected, rel=1e-9, abs=1e-9
        )
        arms = [path.computeMomentArm(state, coordinate) for coordinate in coordinates]
        result = paths.moment_arms(q)[name]
        assert [result.get(info.path, 0.0) for info in mechanism.coordinates] == pytest.approx(
            arms, rel=0, abs=1e-9
        )


SIZES = {
    "ring of radius 0": ContactTorus(torus_radius=0.0, tube_radius=0.05),
    "ring of negative radius": ContactTorus(torus_radius=-0.08, tube_radius=0.03),
    "tube of radius 0": ContactTorus(torus_radius=0.08, tube_radius=0.0),
    "tube of negative radius": ContactTorus(torus_radius=0.08, tube_radius=-0.03),
    "sphere of radius 0": ContactSphere(radius=0.0),
    "sphere of negative radius": ContactSphere(radius=-0.05),
    "cylinder of radius 0": ContactCylinder(radius=0.0),
    "cylinder of negative radius": ContactCylinder(radius=-0.05),
    "half axis of 0": ContactEllipsoid(radii=(0.04, 0.0, 0.05)),
    "negative half axis": ContactEllipsoid(radii=(0.04, -0.06, 0.05)),
}
"""Obstacles whose sizes are not positive."""


@pytest.mark.parametrize("geometry", SIZES.values(), ids=SIZES)
def test_sizes_that_are_not_positive(geometry, tmp_path, monkeypatch):
    opensim.Logger.setLevelString("off")
    monkeypatch.setitem(SURFACES, "sized", geometry)
    hint = (0.08, 0, 0.03) if isinstance(geometry, ContactTorus) else (0.01, 0.08, 0.01)
    height = -0.08 if isinstance(geometry, ContactTorus) else 0
    model = carrier((HIGH, over("sized", B0, 0.1, height, 0, hint=hint), END))
    file = tmp_path / "model.osim"
    osimlite.write(model, file)
    findings = osimlite.validate(file)
    codes = {finding.code for finding in findings.errors}
    refusals = [finding for finding in findings.errors if finding.consequence == "refuses"]
    theirs = opensim.Model(str(file))
    try:
        state = theirs.initSystem()
    except RuntimeError:
        assert codes == {"OSIM206", "OSIM534"}
        assert len(refusals) == 2
        with pytest.raises(ModelError, match="size that is not positive"):
            osimlite.paths(model)
        return
    assert not refusals
    if isinstance(geometry, ContactSphere | ContactCylinder):
        # OpenSim rejects some models with a radius of 0.
        assert codes == ({"OSIM206"} if geometry.radius == 0.0 else set())
        with pytest.raises(UnsupportedError, match="radius that is not positive"):
            osimlite.paths(model)
        return
    assert codes == set()
    assert "OSIM207" in {finding.code for finding in findings.warnings}
    length = opensim.PathSpring.safeDownCast(theirs.getForceSet().get(0)).getPath().getLength(state)
    paths = osimlite.paths(model)
    q = paths.mechanism.assemble({})
    assert paths.lengths(q)["/forceset/spring"] == pytest.approx(length, rel=0, abs=1e-9)
