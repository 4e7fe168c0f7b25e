"""Compare contact of ellipsoids with each other and with spheres with a live OpenSim 4.6."""

from __future__ import annotations

import numpy as np
import pytest

from osimlite import ContactHalfSpace, ContactSphere, HuntCrossleyForce
from osimlite.mechanics.laws.ellipsoid_contact import ellipsoid_ellipsoid
from osimlite.mechanics.laws.hunt_crossley import combine_materials, contact_force
from osimlite.mechanics.laws.vectors import ZERO
from osimlite.mechanics.multibody.spatial import rotation_xyz
from osimlite.schema.contact_types import ContactEllipsoid
from tests.suite import choose

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

from tests.oracle.force_carrier import JOINTS, STATES, carrier, compare  # noqa: E402

MATERIAL = {
    "Stiffness": 1e6,
    "Dissipation": 0.5,
    "StaticFriction": 0.8,
    "DynamicFriction": 0.4,
    "ViscousFriction": 0.2,
}
TRANSITION = 0.1


def touching_pair(rng, round_one):
    """Return two random ellipsoids that overlap a little.

    Args:
        rng: random generator.
        round_one: whether the second ellipsoid is a sphere.

    Returns:
        Half axes of both (m), angles (2, 3) in rad, and the centre of the second (m).
    """
    radii = (
        rng.uniform(0.3, 1.0, 3),
        np.full(3, rng.uniform(0.3, 1.0)) if round_one else rng.uniform(0.3, 1.0, 3),
    )
    angles = rng.uniform(-2.0, 2.0, (2, 3))
    along = rng.normal(size=3)
    along /= np.linalg.norm(along)
    wanted, near, far = rng.uniform(0.001, 0.05), 0.05, 2.2
    for _ in range(60):
        middle = 0.5 * (near + far)
        deeper = law(radii, angles, middle * along)[0] > wanted
        near, far = (middle, far) if deeper else (near, middle)
    return radii, angles, near * along


def law(radii, angles, center, a=0.5):
    one, two = (rotation_xyz(turn).T for turn in angles)
    return ellipsoid_ellipsoid(ZERO, one, radii[0], center, two, radii[1], a)


def by_opensim(radii, angles, center, velocity):
    opensim.Logger.setLevelString("off")
    model = opensim.Model()
    model.setGravity(opensim.Vec3(0))
    zero = opensim.Vec3(0)
    body = opensim.Body("body", 1.0, zero, opensim.Inertia(1, 1, 1))
    model.addBody(body)
    joint = opensim.FreeJoint("free", model.getGround(), zero, zero, body, zero, zero)
    model.addJoint(joint)
    force = opensim.HuntCrossleyForce()
    force.setName("contact")
    force.set_transition_velocity(TRANSITION)
    for name, size, turn, frame in zip(
        ("one", "two"), radii, angles, (model.getGround(), body), strict=True
    ):
        if np.ptp(size) == 0.0:
            geometry = opensim.ContactSphere(size[0], zero, frame, name)
        else:
            geometry = opensim.ContactEllipsoid(
                opensim.Vec3(*size), zero, opensim.Vec3(*turn), frame, name
            )
        model.addContactGeometry(geometry)
        force.addGeometry(name)
    for name, value in MATERIAL.items():
        getattr(force, f"set{name}")(value)
    model.addForce(force)
    state = model.initSystem()
    for axis in range(3):
        joint.get_coordinates(3 + axis).setValue(state, float(center[axis]))
        joint.get_coordinates(3 + axis).setSpeedValue(state, float(velocity[axis]))
    model.realizeDynamics(state)
    labels, row = force.getRecordLabels(), force.getRecordValues(state)
    result = {labels.get(k): row.get(k) for k in range(labels.size())}
    parts = [
        [result[f"contact.body.{what}.{axis}"] for axis in "XYZ"] for what in ("force", "torque")
    ]
    return np.array(parts), model.calcPotentialEnergy(state)


@pytest.mark.parametrize("round_one", [False, True], ids=["ellipsoid", "sphere"])
def test_random_pairs(round_one):
    rng = np.random.default_rng(5)
    k, a, *rest = combine_materials(*MATERIAL.values(), *MATERIAL.values())
    for _ in range(choose(15, 60)):
        radii, angles, center = touching_pair(rng, round_one)
        velocity = rng.normal(size=3)
        (force, torque), _ = by_opensim(radii, angles, center, velocity)
        d, R, n, point = law(radii, angles, center, a)
        ours = np.array(contact_force(d, R, k, *rest, TRANSITION, n, -velocity))
        scale = 1e-9 * max(1.0, np.abs(force).max())
        assert np.abs(ours - force).max() < scale
        assert np.abs(np.cross(np.array(point) - center, ours) - torque).max() < scale


@pytest.mark.parametrize("kinds", list(JOINTS.values()), ids=list(JOINTS))
def test_in_a_model(kinds, tmp_path):
    model = carrier(kinds)
    egg = ContactEllipsoid(
        name="egg",
        socket_frame="/bodyset/b2/f2",
        location=(0.1, 0.0, -0.1),
        orientation=(0.5, -0.3, 0.7),
        radii=(0.2, 0.5, 0.4),
    )
    other = ContactEllipsoid(
        name="other", socket_frame="/ground", location=(0.5, 0.3, 0.4), radii=(0.6, 0.3, 0.4)
    )
    ball = ContactSphere(
        name="ball", socket_frame="/bodyset/b0/f0", location=(0.4, 0.1, 0.2), radius=0.35
    )
    plane = ContactHalfSpace(
        name="plane", socket_frame="/ground", location=(0, -0.6, 0), orientation=(0.1, 0.2, -1.4)
    )
    model.add(egg, other, ball, plane)
    for number, surfaces in enumerate(
        ((egg, other), (egg, ball), (other, ball), (ball, plane, egg))
    ):
        force = HuntCrossleyForce(name=f"contact{number}", transition_velocity=0.1)
        for index, surface in enumerate(surfaces):
            force.contact_parameters.objects.append(
                HuntCrossleyForce.ContactParameters(
                    geometry=(surface,),
                    stiffness=1e4 * (1 + index),
                    dissipation=0.01,
                    static_friction=0.5,
                )
            )
        model.add(force)
    assert 0 < compare(model, tmp_path) < STATES * 5 * 12
