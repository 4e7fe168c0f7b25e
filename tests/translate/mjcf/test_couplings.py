"""Tests of functions of coordinates in MuJoCo: polynomials are exact, others have the errors that are recorded."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import osimlite
from osimlite import (
    Body,
    Constant,
    Coordinate,
    EllipsoidJoint,
    LinearFunction,
    Model,
    MultiplierFunction,
    PolynomialFunction,
    SimmSpline,
    Sine,
    SpringGeneralizedForce,
    TransformAxis,
)
from osimlite.translate import to_mjcf
from tests.translate.mjcf.compiled import Compiled
from tests.translate.mjcf.support import INERTIA, coupled, equalities, off, on_a_function

EXACT = {
    "line": LinearFunction(coefficients=(0.2, 0.1)),
    "cubic": PolynomialFunction(coefficients=(0.3, -0.2, 0.1, 0.05)),
    "quartic": PolynomialFunction(coefficients=(0.1, 0.3, -0.2, 0.1, 0.05)),
    "scaled": MultiplierFunction(
        function=PolynomialFunction(coefficients=(0.3, -0.2, 0.1)), scale=0.4
    ),
}


@pytest.mark.parametrize("function", EXACT.values(), ids=EXACT)
def test_polynomials_are_written_exactly(function):
    mjcf = to_mjcf(on_a_function(function))
    assert not mjcf.fidelity.records
    compiled = Compiled(mjcf)
    for q in np.linspace(-3.0, 3.0, 7):
        assert abs(off(compiled, np.array((q,)))["q_tx"]) < 1e-14


FITTED = {
    "sine": Sine(amplitude=0.3, omega=1.5, phase=0.2),
    "spline": SimmSpline(x=(-1.0, 0.0, 0.5, 1.2, 2.0), y=(0.1, 0.3, 0.2, 0.25, 0.4)),
    "of degree six": PolynomialFunction(coefficients=(0.01, 0.0, 0.0, 0.1, 0.0, 0.2, 0.1)),
}


@pytest.mark.parametrize("function", FITTED.values(), ids=FITTED)
def test_other_functions_are_off_by_what_is_said(function):
    mjcf = to_mjcf(on_a_function(function), spline="quartic")
    (record,) = mjcf.fidelity.records
    compiled = Compiled(mjcf)
    differences = [off(compiled, np.array((q,)))["q_tx"] for q in np.linspace(-1.0, 2.0, 301)]
    error = record.errors["value"]
    assert error.unit == "m" and np.abs(differences).max() == pytest.approx(error.max, rel=0.02)
    assert np.sqrt(np.mean(np.square(differences))) == pytest.approx(error.rms, rel=0.05)
    # The fit is optimal: the largest error occurs six times with alternating signs (Chebyshev).
    peaks = [value for value in differences if abs(value) > 0.9 * error.max]
    assert np.count_nonzero(np.diff(np.sign(peaks))) >= 5


def test_a_quartic_of_a_quartic_is_closer():
    model = on_a_function(FITTED["spline"])
    (once,), twice = to_mjcf(model, spline="quartic").fidelity.records, to_mjcf(model)
    (record,) = twice.fidelity.records
    assert record.errors["value"].rms < 0.5 * once.errors["value"].rms
    compiled = Compiled(twice)
    differences = [off(compiled, np.array((q,)))["q_tx"] for q in np.linspace(-1.0, 2.0, 301)]
    assert np.abs(differences).max() == pytest.approx(record.errors["value"].max, rel=0.02)


@pytest.mark.parametrize("turns", [True, False], ids=["besides a hinge", "alone"])
def test_motions_are_nearly_those_of_the_model(turns):
    model = on_a_function(FITTED["sine"])
    axes = model["/jointset/j"].spatial_transform
    axes.translation3 = TransformAxis(
        coordinates=("q",), axis=(0, 0, 1), function=Sine(amplitude=0.2, omega=1.0)
    )
    if not turns:
        axes.rotation3.function = Constant(value=0.0)
    model.add(SpringGeneralizedForce(name="s", coordinate="q", stiffness=20.0, rest_length=0.8))
    compiled = Compiled(to_mjcf(model))
    mujoco.mj_resetDataKeyframe(compiled.model, compiled.data, 0)
    for _ in range(100):
        mujoco.mj_step(compiled.model, compiled.data)
    ((wanted,),) = osimlite.simulate(model, to=0.1, accuracy=1e-9).values[-1:]
    assert compiled.data.joint("q").qpos[0] - 0.3 == pytest.approx(wanted - 0.3, rel=0.025)
    assert np.abs(compiled.data.efc_pos).max() < 2e-4


def test_a_range_that_nobody_meant_is_that_of_the_knots():
    spline = SimmSpline(x=(-1.0, 0.0, 0.5, 1.2, 2.0), y=(0.1, 0.3, 0.2, 0.25, 0.4))
    (wide,) = to_mjcf(on_a_function(spline, range=(-99999.9, 99999.9))).fidelity.records
    (record,) = to_mjcf(on_a_function(spline)).fidelity.records
    assert wide.errors == record.errors and "from -1 to 2" in wide.detail


def test_couplers_are_composed_into_the_functions_of_the_coordinate():
    model = coupled(LinearFunction(coefficients=(0.5, 0.2)))
    mjcf = to_mjcf(model)
    assert not mjcf.fidelity.records
    # The polynomial is (q / 2 + 0.2)^2.
    leader, polynomial = equalities(Compiled(mjcf))["beta_rx"]
    assert leader == "q"
    np.testing.assert_allclose(polynomial, (0.04, 0.2, 0.25, 0.0, 0.0), rtol=0.0, atol=1e-15)
    assert mjcf.fidelity.translated["/constraintset/c"] == "equality beta_rx"


def test_a_coordinate_that_is_only_an_argument_gets_a_joint():
    spline = SimmSpline(x=(-1.0, 0.0, 0.5, 1.2, 2.0), y=(0.1, 0.3, 0.2, 0.25, 0.4))
    model = on_a_function(spline)
    model["/jointset/j"].spatial_transform.rotation3.function = Constant(value=0.0)
    mjcf = to_mjcf(model, spline="quartic")
    compiled = Compiled(mjcf)
    assert equalities(compiled)["q_tx"][0] == "q"
    assert {record.kind for record in mjcf.fidelity} == {"argument", "function"}
    mujoco.mj_resetDataKeyframe(compiled.model, compiled.data, 0)
    assert compiled.data.joint("q").qpos[0] == 0.3


def test_a_function_of_a_locked_coordinate_is_a_number():
    model = coupled(LinearFunction(coefficients=(0.5, 0.2)))
    model["/jointset/j/q"].locked = True
    leader, polynomial = equalities(Compiled(to_mjcf(model)))["beta_rx"]
    assert leader is None and polynomial[0] == pytest.approx(0.35**2, abs=1e-15)


def test_a_lock_holds_the_coordinate_that_a_coupler_follows():
    model = coupled(LinearFunction(coefficients=(0.5, 0.2)))
    beta = model["/jointset/k/beta"]
    beta.locked, beta.default_value = True, 0.6
    mjcf = to_mjcf(model)
    held = equalities(Compiled(mjcf))
    # The body rotates by the coordinate, and slides by a tenth of it.
    (leader,) = {name for name, (_, polynomial) in held.items() if not polynomial[1:].any()}
    assert held[leader][0] is None and held[leader][1][0] == pytest.approx(0.8, abs=1e-9)
    assert list(mjcf.fidelity) == []
    assert mjcf.fidelity.translated["/constraintset/c"] == f"equality {leader}"


@pytest.mark.parametrize("is_locked", [False, True])
def test_a_lock_holds_nothing_through_a_constant(is_locked):
    model = coupled(Constant(value=0.6))
    model["/jointset/j/q"].locked = is_locked
    beta = model["/jointset/k/beta"]
    beta.locked, beta.default_value = True, 0.6
    mjcf = to_mjcf(model)
    assert None not in {leader for leader, _ in equalities(Compiled(mjcf)).values()}
    assert mjcf.fidelity.translated["/constraintset/c"].startswith("nothing: ")


def test_a_body_stays_on_its_ellipsoid():
    model = Model(name="shoulder")
    body = model.add(Body(name="scapula", mass=1.0, inertia=INERTIA, mass_center=(0.0, 0.0, 0.1)))
    coordinates = [
        Coordinate(name=name, default_value=value)
        for name, value in zip("abc", (0.3, 0.4, -0.2), strict=True)
    ]
    joint = EllipsoidJoint(name="j", radii_x_y_z=(0.1, 0.25, 0.18), coordinates=coordinates)
    model.add(
        joint.between(
            model.ground,
            body,
            at=(0.1, 0.2, 0.3),
            turned=(0.2, 0.1, 0.5),
            child_at=(0.01, 0.02, 0.0),
        )
    )
    mjcf = to_mjcf(model)
    compiled, mechanism = Compiled(mjcf), mjcf.robot.mechanism
    mujoco.mj_resetDataKeyframe(compiled.model, compiled.data, 0)
    mujoco.mj_forward(compiled.model, compiled.data)
    assert np.abs(compiled.data.efc_pos).max() < 1e-12
    for _ in range(200):
        mujoco.mj_step(compiled.model, compiled.data)
    mujoco.mj_forward(compiled.model, compiled.data)
    q = {name: compiled.data.joint(name).qpos[0] for name in "abc"}
    assert abs(q["a"] - 0.3) > 0.05
    np.testing.assert_allclose(
        compiled.body("scapula"), mechanism.body_transforms(q)["scapula"], rtol=0.0, atol=1e-4
    )
