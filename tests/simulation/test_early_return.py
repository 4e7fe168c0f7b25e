"""Tests of several contacts in one force with the PyBullet engine, with and without Simbody's early return."""

from __future__ import annotations

import math

import numpy as np
import pytest

import osimlite
from osimlite import Body, ContactHalfSpace, ContactSphere, Coordinate, HuntCrossleyForce, Model
from osimlite.mechanics.laws.hunt_crossley import half_space_sphere
from osimlite.mechanics.multibody import build_mechanism
from osimlite.simulation.elements import force_elements
from tests.mechanics.laws.contact_sets import contact_forces, simbody_pair_order

pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")

from osimlite.simulation.engines.bullet.engine import BulletEngine


def sled(positions, *, early_return):
    """Return mechanism and forces of two balls on sliders above a floor, with a single contact force."""
    model = Model(name="sled")
    floor = ContactHalfSpace(
        name="floor", socket_frame=model.ground, orientation=(0.0, 0.0, -math.pi / 2)
    )
    balls = []
    for name, x in zip("AB", positions, strict=True):
        body = model.add(Body(name=name, mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
        joint = osimlite.SliderJoint(
            name=f"slider{name}", coordinates=[Coordinate(name=f"y{name}")]
        )
        upright = (0.0, 0.0, math.pi / 2)
        model.add(
            joint.between(
                model.ground, body, at=(x, 0.0, 0.0), turned=upright, child_turned=upright
            )
        )
        balls.append(ContactSphere(name=f"ball{name}", socket_frame=body, radius=0.05))
    model.add(floor, *balls)
    material = HuntCrossleyForce.ContactParameters(
        geometry=(*balls, floor), stiffness=1e6, dissipation=2.0
    )
    force = HuntCrossleyForce(name="f", transition_velocity=0.2)
    force.contact_parameters.objects.append(material)
    model.add(force)
    mechanism = build_mechanism(model)
    return mechanism, force_elements(model, mechanism, simbody_early_return=early_return)


@pytest.mark.parametrize("early_return", [False, True])
@pytest.mark.parametrize("positions", [(0.0, 1.0), (1.0, 0.0)])
@pytest.mark.parametrize("speeds", [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
def test_simbodys_early_return_behind_its_switch(positions, speeds, early_return):
    mechanism, forces = sled(positions, early_return=early_return)
    with BulletEngine(mechanism, forces) as engine:
        udot = engine.compute_accelerations(0.0, [0.04, 0.04], speeds)
        stored = engine.compute_energies(0.0, engine.state.pack([0.04, 0.04], speeds))[2]
    (element,) = forces.elements
    k, a, *rest = element.pairs[0].effective
    d, *_ = half_space_sphere((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.04, 0.0), 0.05, a)
    contacts = {n: (d, 0.05, k, *rest, 0.0, 1.0, 0.0, 0.0, -speeds[n], 0.0) for n in range(2)}
    order = [
        max(pair) if 2 not in pair else min(pair)
        for pair in simbody_pair_order(
            [(positions[0], 0.04, 0), (positions[1], 0.04, 0), (0, 0, 0)], [0.05, 0.05, math.inf]
        )
    ]
    result, energy = contact_forces(
        [contacts[n] for n in order], 0.2, simbody_early_return=early_return
    )
    expected = dict(zip(order, (force[1] - 9.80665 for force in result), strict=True))
    assert udot == pytest.approx([expected[0], expected[1]], rel=1e-9)
    assert stored == pytest.approx(energy, rel=1e-9)
    lost = early_return and any(speeds) and list(expected.values()).count(-9.80665) == 2
    assert lost == (early_return and (speeds, positions) in (((1, 0), (0, 1)), ((0, 1), (1, 0))))


def test_spheres_of_one_force_push_each_other():
    """The forces are equal and opposite, along the line of the centres."""
    mechanism, forces = sled((0.0, 0.06), early_return=False)
    (element,) = forces.elements
    assert len(element.pairs) == 3
    with BulletEngine(mechanism, forces) as engine:
        row = dict(
            zip(
                engine.columns,
                engine.force_records(0.0, engine.state.pack([1.0, 1.01], [0.0, 0.0])),
                strict=True,
            )
        )
        assert (
            engine.find_touching_contacts(
                0.0, engine.state.pack([1.0, 1.01], [0.0, 0.0])
            ).bit_count()
            == 1
        )
    push = np.array([row[f"f.B.force.{axis}"] for axis in "XYZ"])
    assert push == pytest.approx(-np.array([row[f"f.A.force.{axis}"] for axis in "XYZ"]))
    gap = np.array((0.06, 0.01, 0.0))
    assert push / np.linalg.norm(push) == pytest.approx(gap / np.linalg.norm(gap))
