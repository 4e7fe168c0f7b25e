"""Compare random HuntCrossleyForces with several spheres with OpenSim.

The result depends on the order of OpenSim's computation and on its early return.
"""

from __future__ import annotations

import itertools
from math import inf

import numpy as np
import pytest

from osimlite.mechanics.laws.hunt_crossley import (
    combine_materials,
    half_space_sphere,
    sphere_sphere,
)
from tests.mechanics.laws.contact_sets import contact_forces, simbody_pair_order

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

# Values of the properties below, in SI units.
MATERIAL = 1e6, 1.5, 0.8, 0.4, 0.3
PROPERTIES = "Stiffness", "Dissipation", "StaticFriction", "DynamicFriction", "ViscousFriction"
# Transition velocity of friction (m/s).
TRANSITION = 0.1
NORMAL = 0.0, 1.0, 0.0


def draw(rng):
    """Return random radii, positions and velocities of spheres near the plane y = 0.

    The spheres are close enough to touch each other too.

    Returns:
        Radii (n,), positions (n, 3) and velocities (n, 3).
    """
    count = int(rng.integers(2, 7))
    radii = rng.uniform(0.03, 0.08, count)
    positions = rng.uniform(-0.15, 0.15, (count, 3))
    positions[:, 1] = radii - rng.uniform(-0.01, 0.02, count)
    return radii, positions, rng.uniform(-1.0, 1.0, (count, 3))


def by_opensim(radii, positions, velocities):
    """Return OpenSim's force on each sphere and the energy of the HuntCrossleyForce."""
    opensim.Logger.setLevelString("error")
    model = opensim.Model()
    model.setGravity(opensim.Vec3(0))
    plane = opensim.ContactHalfSpace(
        opensim.Vec3(0), opensim.Vec3(0, 0, -np.pi / 2), model.getGround(), "plane"
    )
    model.addContactGeometry(plane)
    contact = opensim.HuntCrossleyForce()
    contact.setName("contact")
    contact.set_transition_velocity(TRANSITION)
    contact.addGeometry("plane")
    joints = []
    for i, radius in enumerate(radii):
        body = opensim.Body(f"body{i}", 1.0, opensim.Vec3(0), opensim.Inertia(1, 1, 1))
        model.addBody(body)
        joints.append(opensim.FreeJoint(f"joint{i}", model.getGround(), body))
        model.addJoint(joints[-1])
        model.addContactGeometry(
            opensim.ContactSphere(float(radius), opensim.Vec3(0), body, f"sphere{i}")
        )
        contact.addGeometry(f"sphere{i}")
    for name, value in zip(PROPERTIES, MATERIAL, strict=True):
        getattr(contact, f"set{name}")(value)
    model.addForce(contact)
    state = model.initSystem()
    for joint, position, velocity in zip(joints, positions, velocities, strict=True):
        for axis in range(3):
            joint.get_coordinates(3 + axis).setValue(state, float(position[axis]))
            joint.get_coordinates(3 + axis).setSpeedValue(state, float(velocity[axis]))
    model.realizeDynamics(state)
    record = contact.getRecordValues(state)
    labels = contact.getRecordLabels()
    columns = {labels.get(i): record.get(i) for i in range(labels.size())}
    forces = [
        [columns[f"contact.body{i}.force.{axis}"] for axis in "XYZ"] for i in range(len(radii))
    ]
    return np.array(forces), model.calcPotentialEnergy(state)


def by_osimlite(radii, positions, velocities, simbody_early_return):
    k, a, *rest = combine_materials(*MATERIAL, *MATERIAL)
    centres = [(0.0, 0.0, 0.0), *map(tuple, positions)]
    moves = [(0.0, 0.0, 0.0), *map(tuple, velocities)]
    contacts, bodies = [], []
    for first, second in simbody_pair_order(centres, [inf, *radii]):
        if first == 0:
            n, R = NORMAL, radii[second - 1]
            d, _ = half_space_sphere(centres[0], n, centres[second], R, a)
        else:
            one, two = ((centres[i], radii[i - 1]) for i in (first, second))
            d, R, n, _ = sphere_sphere(*one, *two, a)
        v = (p - q for p, q in zip(moves[first], moves[second], strict=True))
        contacts.append((d, R, k, *rest, *n, *v))
        bodies.append((first, second))
    result, energy = contact_forces(contacts, TRANSITION, simbody_early_return)
    forces = np.zeros((len(centres), 3))
    for (first, second), force in zip(bodies, result, strict=True):
        forces[first] -= force
        forces[second] += force
    return forces[1:], energy


def test_random_sets_of_spheres():
    rng = np.random.default_rng(20)
    suppressed = 0
    for _ in range(60):
        case = draw(rng)
        expected, energy = by_opensim(*case)
        forces, found_energy = by_osimlite(*case, simbody_early_return=True)
        scale = max(1.0, np.abs(expected).max())
        assert np.abs(forces - expected).max() <= 1e-9 * scale
        assert found_energy == pytest.approx(energy, rel=1e-9)
        alone, _ = by_osimlite(*case, simbody_early_return=False)
        suppressed += not np.allclose(alone, expected, rtol=1e-6)
    # The early return must change the result of some of the draws, and not of all.
    assert 5 < suppressed < 60


def test_one_sphere_a_force_has_no_early_return():
    """A force between a plane and one sphere is the same with and without the early return."""
    rng = np.random.default_rng(21)
    for _, early in itertools.product(range(5), (True, False)):
        radii, positions, velocities = (x[:1] for x in draw(rng))
        expected, energy = by_opensim(radii, positions, velocities)
        forces, found_energy = by_osimlite(radii, positions, velocities, early)
        assert forces == pytest.approx(expected, rel=1e-9, abs=1e-9)
        assert found_energy == pytest.approx(energy, rel=1e-9)
