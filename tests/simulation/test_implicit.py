"""Tests of integrators for stiff motions: linear equations, order, errors, constraints, contacts and cost."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite import (
    Body,
    ContactHalfSpace,
    ContactSphere,
    Coordinate,
    HuntCrossleyForce,
    Model,
    PlanarJoint,
)
from osimlite.errors import SettingError
from osimlite.mechanics.kernels.condensation import (
    condensation_size,
    condense_system,
    linearise_state,
    solve_condensed,
)
from osimlite.mechanics.kernels.layout import MODEL, OUTCOME, STAGE
from osimlite.mechanics.kernels.rosenbrock import ALPHA, EMBEDDED, GAMMA, WEIGHTS
from osimlite.mechanics.multibody import build_mechanism
from osimlite.simulation import Simulation
from osimlite.simulation.batches import run_many
from osimlite.simulation.elements import force_elements
from osimlite.simulation.engines.controlled_steps import ControlledSteps
from osimlite.simulation.engines.linking import PYTHON_CODE
from osimlite.simulation.options import IntegrationOptions
from osimlite.simulation.system import System
from tests.simulation.elements.muscle_rows import hung, muscle
from tests.simulation.equations import Equations, last, oscillator
from tests.simulation.support import MODELS
from tests.suite import choose

METHODS = "adams", "bdf", "rosenbrock"


def steps_of(
    f: Any, y: list[float], accuracy: float, method: str, to: float = 3.0
) -> tuple[list[float], Any]:
    """Integrate auxiliary states only.

    Args:
        f: derivative function of (t, y).
        y: initial state.
        accuracy: accuracy of the integrator.
        method: the integrator.
        to: end time.

    Returns:
        Final state, and the stepper.
    """
    options = IntegrationOptions(accuracy=accuracy, integrator=method)
    stepper = ControlledSteps(Equations(f, len(y), 0), 0.0, y, options)  # type: ignore[arg-type]
    return last(stepper.iterate_steps(to))[1], stepper


def hanging(case: str, excitation: float = 0.5, gravity: float = 9.80665) -> Any:
    """Return a model of a block that hangs on a muscle away from its equilibrium.

    Args:
        case: the muscle, a name in CONFIGURATIONS.
        excitation: constant excitation.
        gravity: gravity (m/s²).
    """
    force = muscle(case)
    force.default_activation = 0.6 * excitation
    model = hung(force, (excitation, excitation), gravity)
    model.find("/jointset/slide/x").default_value = 0.33
    return model


# -------------------------------------------------------------------------------------------------- linear equations
@pytest.mark.parametrize(
    "case", ["thelen_default", "millard_damped", "millard_rigid", "dgf_default"]
)
def test_condensed_equations_are_those_of_all_states(case):
    """On a slider only the muscle has derivatives, so J equals that of the engine."""
    model = hanging(case)
    with Simulation(model, "compiled") as simulation:
        y = np.array(simulation.initial_state({}, {"x": 0.1}, equilibrate=True))
    assert_condensed(model, y)


def rolling(is_smooth: bool = False, **material: float) -> Any:
    """Return a body with an eccentric ball that rolls and slips over a floor.

    Args:
        is_smooth: use the smooth contact law.
        material: properties of the contact.
    """
    model = Model(name="rolling")
    body = model.add(Body(name="body", mass=2.0, inertia=(0.01, 0.01, 0.01, 0, 0, 0)))
    joint = PlanarJoint(name="plane")
    joint.coordinates = [Coordinate(name=name) for name in ("turn", "along", "height")]
    model.add(joint.between(model.ground, body))
    floor = ContactHalfSpace(
        name="floor", socket_frame=model.ground, orientation=(0, 0, -0.5 * math.pi)
    )
    ball = ContactSphere(name="ball", socket_frame=body, radius=0.1, location=(0.3, -0.1, 0.0))
    if is_smooth:
        model.add(floor, ball)
        sockets = {"socket_half_space": floor, "socket_sphere": ball}
        model.add(
            osimlite.SmoothSphereHalfSpaceForce(
                name="contact", stiffness=1e6, transition_velocity=0.15, **sockets, **material
            )
        )
        return model
    contact = HuntCrossleyForce(name="contact", transition_velocity=0.15)
    contact.contact_parameters.objects.append(
        HuntCrossleyForce.ContactParameters(geometry=(floor, ball), stiffness=1e6, **material)
    )
    model.add(floor, ball, contact)
    return model


@pytest.mark.parametrize("is_smooth", [False, True])
def test_equations_of_a_contact_are_those_of_all_coordinates(is_smooth):
    """Friction is proportional to slip; the equations neglect only how penetration moves the contact point."""
    material = {"dissipation": 0.0} if is_smooth else {}
    model = rolling(is_smooth, static_friction=0.8, dynamic_friction=0.8, **material)
    # For smooth contact they also neglect how coordinates rotate the lever arm.
    assert_condensed(
        model, np.array([0.3, 0.0, 0.095, 3.0, -0.2, -0.9]), rel=0.02 if is_smooth else 0.01
    )


def assert_condensed(model, y, rel=1e-4):
    """Compare solutions of the condensed linear equations with those by finite differences of the state derivative.

    Args:
        model: the model.
        y: state.
        rel: relative tolerance.
    """
    mechanism = build_mechanism(model)
    system = System(mechanism, force_elements(model, mechanism), code=PYTHON_CODE)
    s = system.structure
    system.program.link_responses("bdf")
    size, c = int(s[MODEL.DOFS]), 2e-3
    room, f = np.zeros(condensation_size(size, int(s[MODEL.RESPONSES]))), np.zeros(len(y))
    rates = partial(rates_at, system)
    jacobian = np.column_stack(
        [(rates(y + h) - rates(y - h)) / 2e-6 for h in 1e-6 * np.eye(len(y))]
    )
    assert (
        linearise_state(system.program.ints, system.numbers, system.work_vector, y, f, room, 0.0)
        == OUTCOME.OK
    )
    assert condense_system(system.program.ints, c, room)
    right = np.random.default_rng(1).uniform(-1.0, 1.0, len(y))
    result = right.copy()
    solve_condensed(system.program.ints, c, room, result)
    assert result == pytest.approx(
        np.linalg.solve(np.eye(len(y)) - c * jacobian, right), rel=rel, abs=1e-6
    )


def rates_at(system: System, y: Any) -> Any:
    assert system.realize(0.0, y, STAGE.ACCELERATION) == OUTCOME.OK
    return np.array(system.get_derivative())


# ---------------------------------------------------------------------------------------------- order of convergence
@pytest.mark.parametrize(("method", "order"), [("adams", 7), ("bdf", 5), ("rosenbrock", 2)])
def test_steps_grow_with_the_accuracy_as_the_order_says(method, order):
    """The estimated error is of order h^(k + 1) in a formula of order k, and h^k in the embedded one of order k - 1.

    These equations do not use J, so that Rosenbrock's method has the order that it has for any J.
    """
    power = order if method == "rosenbrock" else order + 1
    # Rosenbrock's method takes 30 times as many steps at 1e-8 as at 1e-5.
    accuracies = (1e-5, 1e-8) if order > 2 else choose((1e-4, 1e-6), (1e-5, 1e-7))
    loose, tight = (
        steps_of(oscillator, [1.0, 0.0], accuracy, method)[1].accepted for accuracy in accuracies
    )
    assert tight / loose == pytest.approx(
        (accuracies[0] / accuracies[1]) ** (1.0 / power), rel=0.25
    )


def test_rosenbrock_has_order_3():
    """The order is 3, and 2 for any J; a stiffly decaying component reaches its limit at the end of a step."""
    alpha, weights, embedded = (np.array(part) for part in (ALPHA, WEIGHTS, EMBEDDED))
    beta, ones = alpha + np.array(GAMMA), np.ones(4)
    c = alpha @ ones
    conditions = [
        weights @ v
        for v in (ones, beta @ ones, c, c * c, beta @ beta @ ones, np.linalg.solve(beta, ones))
    ]
    assert conditions == pytest.approx([1.0, 1 / 2, 1 / 2, 1 / 3, 1 / 6, 1.0], abs=1e-14)
    assert [embedded @ v for v in (ones, beta @ ones)] == pytest.approx([1.0, 0.5], abs=1e-14)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("accuracy", [1e-3, 1e-5, pytest.param(1e-7, marks=pytest.mark.full)])
def test_error_follows_the_accuracy(method, accuracy):
    y, stepper = steps_of(oscillator, [1.0, 0.0], accuracy, method)
    error = max(abs(y[0] - math.cos(3.0)), abs(y[1] + math.sin(3.0)))
    assert 1e-3 * accuracy < error < 2.0 * accuracy * stepper.accepted


@pytest.mark.parametrize("method", METHODS)
def test_a_jump_is_passed(method):
    """Steps are short at the discontinuity, and only there."""
    y, stepper = steps_of(lambda t, y: [0.0 if t < 1.0 else 10.0], [0.0], 1e-6, method, to=2.0)
    assert y[0] == pytest.approx(10.0, abs=1e-4)
    assert stepper.attempted < 300


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("accuracy", "advice"), [(1e-4, "larger"), (3e-3, "smaller")])
def test_a_motion_that_explodes_is_an_error(method, accuracy, advice):
    words = rf"cannot continue at t = (0\.99|1\.00).* use a {advice} accuracy value"
    with pytest.raises(osimlite.errors.SimulationError, match=words):
        steps_of(lambda t, y: [y[0] * y[0]], [1.0], accuracy, method, to=2.0)


# ----------------------------------------------------------------------------------------------------------- motions
@pytest.mark.parametrize(
    ("case", "method"),
    [("thelen_default", "bdf"), ("millard_damped", "rosenbrock"), ("dgf_default", "adams")],
)
def test_a_block_hangs_on_a_muscle(case, method):
    with Simulation(hanging(case), "compiled", equilibrate=True) as simulation:
        exact = simulation.run(0.3, accuracy=1e-9)
        result = simulation.run(0.3, accuracy=1e-6, integrator=method)
    assert (
        result.summary["integrator"]
        == {"adams": "Adams", "bdf": "BDF", "rosenbrock": "Rosenbrock"}[method]
    )
    # Compare at every report, and thereby the interpolation.
    assert np.abs(result.values - exact.values).max() < 2e-5
    for path, values in exact.auxiliary.items():
        assert np.abs(result.auxiliary[path] - values).max() < 2e-5, path


@pytest.mark.parametrize(
    ("number", "method"), [("m0001", "bdf"), ("m0001", "rosenbrock"), ("m0005", "adams")]
)
def test_real_models_move(number, method, corpus):
    """The models are an arm and a gait model."""
    (path,) = (model.path for model in corpus if model.id == number)
    with Simulation(osimlite.read(path), "compiled", equilibrate=True) as simulation:
        exact = simulation.run(0.05, accuracy=1e-8)
        result = simulation.run(0.05, accuracy=1e-5, integrator=method)
    assert np.abs(result.values - exact.values).max() < 1e-4
    assert np.abs(result.speeds - exact.speeds).max() < 1e-2
    assert result.summary["evaluations"] < exact.summary["evaluations"] / 2


def test_a_stiff_muscle_needs_few_evaluations():
    with Simulation(hanging("dgf_default", 0.02, 1.0), "compiled", equilibrate=True) as simulation:
        counts = {
            name: simulation.run(1.0, accuracy=1e-3, integrator=name).summary["evaluations"]
            for name in ("merson", *METHODS)
        }
    assert 10 * max(counts["bdf"], counts["rosenbrock"]) < counts["merson"]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", MODELS)
def test_constraints_hold(name, method):
    with Simulation(MODELS[name](), "compiled") as simulation:
        exact = simulation.run(0.3, accuracy=1e-8, report_interval=0.1)
        result = simulation.run(0.3, accuracy=1e-5, report_interval=0.1, integrator=method)
    assert np.abs(result.values - exact.values).max() < 1e-3


@pytest.mark.parametrize("method", METHODS)
def test_contacts_begin_and_end(walker, method):
    with Simulation(walker, "compiled") as simulation:
        exact = simulation.run(0.6, accuracy=1e-7).summary["contact_events"]
        result = simulation.run(0.6, accuracy=1e-4, integrator=method).summary["contact_events"]
    assert [event["contact"] for event in result] == [event["contact"] for event in exact]
    assert [event["time_s"] for event in result] == pytest.approx(
        [event["time_s"] for event in exact], abs=1e-4
    )


# -------------------------------------------------------------------------------------------------- many steps per call
@pytest.mark.parametrize("method", METHODS)
def test_steps_do_not_depend_on_how_many_are_taken_in_a_call(walker, method, monkeypatch):
    with Simulation(walker, "compiled", integrator=method) as simulation:
        together = simulation.run(0.2)
        monkeypatch.setattr("osimlite.simulation.engines.controlled_steps.LOGGED_STEPS", 1)
        assert np.array_equal(simulation.run(0.2).values, together.values)


@pytest.mark.parametrize("method", METHODS)
def test_many_runs_are_as_one(walker, method):
    with Simulation(walker, "compiled") as simulation:
        start = simulation.initial_state({}, {})
        rows = np.array([start, start]) + 1e-3 * np.arange(2)[:, None]
        both = run_many(simulation.engine, rows, 0.2, integrator=method, threads=1)
        alone = [
            run_many(simulation.engine, row[None], 0.2, integrator=method).states[0] for row in rows
        ]
    assert np.array_equal(both.states, alone)


def test_an_unknown_integrator_is_refused(walker):
    with Simulation(walker, "compiled") as simulation:
        with pytest.raises(SettingError, match=r"no integrator 'bfd'.*'bdf'"):
            simulation.run(0.1, integrator="bfd")
        with pytest.raises(SettingError, match="no integrator 'bfd'"):
            run_many(simulation.engine, [simulation.initial_state({}, {})], 0.1, integrator="bfd")


@pytest.mark.parametrize(("method", "accuracy"), [("adams", 1e-3), ("bdf", 1e-2)])
def test_derivatives_that_became_too_large_end_no_iteration(method, accuracy):
    model = hung(muscle("thelen_default"))
    # The fiber pulls with e^40 times its force, and with less after each step, so that old
    # derivatives are too large.
    model.find("/forceset/mu").default_fiber_length = 0.16
    with Simulation(model, "compiled") as simulation:
        result, exact = (
            simulation.run(0.1, accuracy=least, integrator=by).auxiliary[
                "/forceset/mu/fiber_length"
            ][-1]
            for least, by in ((accuracy, method), (1e-7, "rosenbrock"))
        )
    assert result == pytest.approx(exact, abs=accuracy)
