"""Tests of the angular acceleration of CustomJoints: the derivative of the velocity, or Simbody's on request."""

from __future__ import annotations

import gzip

import numpy as np
import pytest

from osimlite.io.document.reader import read_text
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody import functions as f
from osimlite.mechanics.multibody.joints import JointAxis, Mobilizer, make_custom_motions
from osimlite.mechanics.multibody.mechanism import (
    CoordinateInfo,
    MassProperties,
    Mechanism,
    MobileBody,
)
from tests.mechanics.multibody.cases import alone


def _knee(*, opensim_derivatives: bool) -> Mechanism:
    """Return a shank on a joint whose first coordinate drives all three rotations and a translation."""
    axes = [
        JointAxis((0,), (0.0, 0.0, 1.0), f.IDENTITY),
        JointAxis((0,), (1.0, 0.0, 0.0), f.Polynomial((0.3, 0.5, 0.1))),
        JointAxis((0, 1), (0.0, 1.0, 0.0), f.WeightedSum((-0.7, 1.0))),
        JointAxis((0,), (1.0, 0.0, 0.0), f.Polynomial((0.1, -0.2, 0.0))),
        JointAxis((1,), (0.0, 1.0, 0.0), f.SineWave(0.1, 2.0, 0.0, 0.0)),
        JointAxis((), (0.0, 0.0, 1.0), f.ConstantValue(0.05)),
    ]
    motions = make_custom_motions(axes[:3], axes[3:], opensim_derivatives=opensim_derivatives)
    properties = MassProperties(2.0, np.array((0.1, -0.3, 0.05)), np.diag((0.03, 0.02, 0.04)))
    body = MobileBody(
        "shank",
        "/bodyset/shank",
        -1,
        properties,
        Mobilizer("/jointset/k", "CustomJoint", motions, (0, 1)),
    )
    coordinates = tuple(
        CoordinateInfo(name, f"/jointset/k/{name}", "/jointset/k", "coupled") for name in "ab"
    )
    return Mechanism("knee", (body,), coordinates)


def _energy_change(mechanism: Mechanism, q, u, steps: int, step: float) -> float:
    """Return the relative change of the energy during a motion under gravity, integrated by Runge-Kutta's method.

    Args:
        mechanism: the mechanism.
        q: initial coordinates.
        u: initial speeds.
        steps: number of steps.
        step: length of a step (s).
    """

    def rates(q, u):
        return mechanism.coordinate_rates(q, u), mechanism.acceleration(q, u)

    def energies(q, u):
        return mechanism.kinetic_energy(q, u), mechanism.potential_energy(q)

    kinetic, potential = energies(q, u)
    largest = kinetic
    for _ in range(steps):
        a, b = rates(q, u)
        c, d = rates(q + step / 2 * a, u + step / 2 * b)
        e, g = rates(q + step / 2 * c, u + step / 2 * d)
        h, i = rates(q + step * e, u + step * g)
        q, u = q + step / 6 * (a + 2 * c + 2 * e + h), u + step / 6 * (b + 2 * d + 2 * g + i)
        largest = max(largest, mechanism.kinetic_energy(q, u))
    return float(abs(sum(energies(q, u)) - kinetic - potential)) / largest


@pytest.mark.parametrize("opensim_derivatives", [False, True])
def test_energy_of_a_knee(opensim_derivatives):
    mechanism = _knee(opensim_derivatives=opensim_derivatives)
    change = _energy_change(mechanism, np.array((0.4, -0.3)), np.array((2.0, -1.0)), 250, 1e-3)
    assert (change > 1e-3) if opensim_derivatives else (change < 1e-9)


def test_the_two_agree_on_everything_but_accelerations():
    ours, theirs = _knee(opensim_derivatives=False), _knee(opensim_derivatives=True)
    q, u = np.array((0.4, -0.3)), np.array((2.0, -1.0))
    one, other = ours.at(q, u), theirs.at(q, u)
    assert other.velocities == pytest.approx(one.velocities, abs=1e-15)
    assert other.origins == pytest.approx(one.origins, abs=1e-15)
    # At rest, Simbody's error vanishes.
    assert theirs.acceleration(q, 0 * u) == pytest.approx(ours.acceleration(q, 0 * u), rel=1e-13)
    assert np.abs(theirs.acceleration(q, u) - ours.acceleration(q, u)).max() > 0.01
    assert theirs.bodies[0].mobilizer.elementary()[1:-1] != ()
    # Three joints that only accelerate represent the difference.
    assert (
        len(theirs.bodies[0].mobilizer.elementary())
        == len(ours.bodies[0].mobilizer.elementary()) + 3
    )


def test_where_each_coordinate_has_its_rotation_the_two_agree():
    axes = [JointAxis((k,), np.eye(3)[k], f.IDENTITY) for k in range(3)]
    still = [JointAxis((), np.eye(3)[k], f.ConstantValue(0.1)) for k in range(3)]
    q, u = np.array((0.4, -0.3, 0.2)), np.array((2.0, -1.0, 0.5))
    built = []
    for switch in (False, True):
        motions = make_custom_motions(axes, still, opensim_derivatives=switch)
        state = alone(Mobilizer("/jointset/k", "CustomJoint", motions, (0, 1, 2))).at(q, u)
        built.append(np.column_stack((state.jacobians[0], state.velocities[0], state.biases[0])))
    assert built[0] == pytest.approx(built[1], abs=1e-15)


@pytest.mark.parametrize("opensim_derivatives", [False, True])
def test_energy_of_a_real_model(corpus, opensim_derivatives):
    """The model is Rajagopal's in the version of Lai and Uhlrich, falling with bent knees."""
    path = next(model.converted for model in corpus if model.id == "m0954")
    model = read_text(gzip.decompress(path.read_bytes()).decode())
    mechanism = build_mechanism(model, opensim_derivatives=opensim_derivatives)
    q, u = mechanism.default_state()
    for side in "rl":
        q[mechanism.coordinate_index(f"knee_angle_{side}")] = 0.6
        u[mechanism.coordinate_index(f"knee_angle_{side}")] = 3.0
    q = mechanism.assemble(q)
    knees = [mechanism.coordinate_index(f"knee_angle_{side}") for side in "rl"]
    change = _energy_change(mechanism, q, mechanism.project_speeds(q, u, kept=knees), 50, 1e-3)
    assert (change > 1e-6) if opensim_derivatives else (change < 1e-9)
