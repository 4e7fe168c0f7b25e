"""Tests of CasADi functions whose values come from searches: paths around surfaces and curves of muscles."""

from __future__ import annotations

import casadi
import numpy as np
import pytest

import osimlite
from osimlite.derivatives.curves import evaluate_curve
from osimlite.errors import UnsupportedError
from osimlite.mechanics.laws.bezier import curve_value, make_curve
from osimlite.mechanics.multibody.functions import ConstantValue
from osimlite.models.jumper import jumper
from tests.conftest import SHARED
from tests.derivatives.machine import Beside, off

CORPUS = SHARED / "corpus" / "models"
GAIT = CORPUS / "m0005"


def kernel_of(model, functions):
    """Return a function that computes the state derivative by the kernels, in the order of the CasADi functions."""
    simulation = osimlite.simulation.Simulation(model, "compiled")

    def derivative(x, u):
        y = [0.0] * len(x)
        for place, value in zip(functions.state_indices, x.tolist(), strict=True):
            y[place] = value
        driven = {
            name: ConstantValue(value)
            for name, value in zip(functions.controls, u.tolist(), strict=True)
        }
        simulation.engine.set_controls(simulation.forces.controls.add_functions(driven))
        return np.array(simulation.engine.compute_derivative(0.0, y))[functions.state_indices]

    return derivative


def states_near(functions, seed, count):
    """Yield random states and controls near the initial state.

    Args:
        functions: the CasADi functions.
        seed: seed of the random numbers.
        count: number of states.
    """
    rng, n = np.random.default_rng(seed), len(functions.coordinates)
    for _ in range(count):
        x = functions.x.copy()
        x[:n] += 0.05 * rng.normal(size=n)
        x[n : 2 * n] += 0.3 * rng.normal(size=n)
        x[2 * n :] *= rng.uniform(1.01, 1.04, len(x) - 2 * n)
        yield x, rng.uniform(0.1, 0.9, len(functions.u))


@pytest.mark.parametrize("number", ["m0161", "m0163"])
def test_shoulders_in_motion(number):
    """Compare state derivatives on shoulder models.

    Around tori and ellipsoids, OpenSim's lengthening speeds differ from moment arms times speeds;
    rates of a scapula's coordinates are not its generalized speeds.
    """
    for path in (CORPUS / number).glob("*.osim"):
        both = Beside(osimlite.read(path))
        assert max(off(both.xdot(x), both.derivative(x)) for x in map(both.state, range(3))) < 1e-9
        return
    pytest.skip("needs the shared reference folder, which is not beside this repository")


def test_wrapped_paths_are_those_of_the_kernels():
    model = jumper()
    model.controller_set.objects.clear()
    functions = osimlite.casadi(model)
    derivative = kernel_of(model, functions)
    for x, u in states_near(functions, 4, 5):
        found, wanted = functions.dynamics(0.0, x, u, functions.p).full().ravel(), derivative(x, u)
        assert np.abs(found - wanted).max() <= 1e-11 * max(1.0, np.abs(wanted).max())
    near = osimlite.linearize(functions, x, u)
    h, slopes = 1e-5, np.zeros_like(near.A)
    for k in range(len(x)):
        e = np.zeros(len(x))
        e[k] = h
        one, two = (derivative(x + s * e, u) - derivative(x - s * e, u) for s in (1.0, 2.0))
        slopes[:, k] = (8.0 * one - two) / (12.0 * h)
    assert np.abs(near.A - slopes).max() <= 1e-6 * np.abs(slopes).max()
    moves = osimlite.linearize(
        functions, x, u, outputs=["mass_center", "mass_center_velocity", "forces"]
    )
    n = len(functions.coordinates)
    assert (
        moves.C[:3, :n] == pytest.approx(moves.C[3:6, n : 2 * n], abs=1e-12) and moves.C[6:].any()
    )
    lengths, _, arms = functions.paths(0.0, x, functions.p)
    known = osimlite.paths(model)
    q = {path: float(value) for path, value in zip(functions.coordinates, x, strict=False)}
    assert dict(zip(functions.path_names, lengths.full().ravel(), strict=True)) == pytest.approx(
        known.lengths(q), abs=1e-12
    )
    for name, row in zip(functions.path_names, arms.full(), strict=True):
        own = dict(zip(functions.coordinates, row.tolist(), strict=True))
        wanted = known.moment_arms(q)[name]
        assert own == pytest.approx({path: wanted.get(path, 0.0) for path in own}, abs=1e-12)


def test_what_depends_on_the_way_is_no_parameter(tmp_path):
    model = jumper()
    with pytest.raises(UnsupportedError, match=r"cannot be a symbol|cannot be a parameter"):
        osimlite.casadi(model, parameters=["/bodyset/femur_l/wrapobjectset/knee_l/radius"])
    with pytest.raises(UnsupportedError, match="paths=polynomial"):
        osimlite.casadi(model).save(tmp_path / "saved")


def test_curves_are_met_to_rounding():
    numbers = make_curve(((0.0, 0.0, 0.0), (0.7, 0.3, 2.0), (1.6, 0.9, 0.0)), (1.0, 0.4))
    x = casadi.SX.sym("x")
    y, slope = evaluate_curve(numbers, x)
    function = casadi.Function("curve", [x], [y, slope, casadi.gradient(y, x)])
    for at in np.linspace(-0.2, 1.8, 401):
        mine, wanted = [float(part) for part in function(at)], curve_value(numbers, at)
        assert mine[:2] == pytest.approx(wanted, abs=1e-11) and mine[2] == pytest.approx(
            wanted[1], abs=1e-8
        )


@pytest.mark.skipif(
    not GAIT.is_dir(),
    reason="needs the shared reference folder, which is not beside this repository",
)
def test_damped_muscles_of_millard():
    (path,) = GAIT.glob("*.osim")
    model = osimlite.read(path)
    functions = osimlite.casadi(model)
    derivative = kernel_of(model, functions)
    for x, u in states_near(functions, 2, 3):
        found, wanted = functions.dynamics(0.0, x, u, functions.p).full().ravel(), derivative(x, u)
        assert np.abs(found - wanted).max() <= 1e-9 * max(1.0, np.abs(wanted).max())


@pytest.mark.skipif(not GAIT.exists(), reason="needs the shared reference folder")
def test_muscles_that_have_no_path_are_left_as_they_are():
    file = GAIT.parent / "m0189/arm26.osim"
    functions = osimlite.casadi(osimlite.read(file), folder=file.parent)
    assert np.isfinite(functions.dynamics(0.0, functions.x, functions.u, functions.p).full()).all()
