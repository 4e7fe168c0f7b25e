"""Compare muscles and actuators with internal states with a live OpenSim 4.6.

The tests compare derivatives, records and energies at random states, and the steps and tables of a
motion.
"""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.mechanics.multibody import build_mechanism
from osimlite.schema.registry import find_class
from osimlite.schema.splines import SimmSpline
from osimlite.simulation import read_sto
from osimlite.simulation.elements import force_elements
from osimlite.simulation.engines.compiled import CompiledEngine
from tests.oracle.opensim_runs import simulated
from tests.scripts import run_script
from tests.simulation.elements.muscle_rows import MASS, hung, line

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

# Number of random states that are compared.
STATES = 6
BOUNDS = {
    "activation": (0.05, 1.1),
    "stretch": (0.0, 0.05),
    "normalized_tendon_force": (0.01, 1.4),
    "fiber_length": (0.03, 0.09),
    "fiber_velocity": (-0.5, 0.5),
}
"""Range of each state from which the tests draw values, by the name of the state."""
# Ranges of random parameters, common to all Hill-type muscles.
HILL = {
    "max_isometric_force": (200, 2000),
    "optimal_fiber_length": (0.05, 0.06),
    "tendon_slack_length": (0.26, 0.28),
    "pennation_angle_at_optimal": (0, 0.5),
    "max_contraction_velocity": (6, 12),
}
SMOOTH = {
    **HILL,
    "default_activation": (0.1, 0.9),
    "active_force_width_scale": (1, 1.6),
    "fiber_damping": (0, 0.1),
}
TIMES = {
    "activation_time_constant": (0.01, 0.02),
    "deactivation_time_constant": (0.03, 0.08),
    "activation_dynamics_smoothing": (0.1, 10),
}
# One process of OpenSim uses the same time constants for all muscles of this class. They have their
# default values here.
DEGROOTE = {
    **SMOOTH,
    "default_normalized_tendon_force": (0.1, 0.4),
    "passive_fiber_strain_at_one_norm_force": (0.5, 0.8),
    "tendon_strain_at_one_norm_force": (0.03, 0.1),
}
TIMED = {**HILL, "time_scale": (0.05, 0.2), "activation1": (5, 9), "activation2": (1, 2)}
THELEN = {
    **HILL,
    "activation_time_constant": (0.005, 0.02),
    "deactivation_time_constant": (0.03, 0.08),
    "Vmax": (8, 12),
    "Vmax0": (4, 6),
    "FmaxTendonStrain": (0.03, 0.06),
    "FmaxMuscleStrain": (0.4, 0.8),
    "KshapeActive": (0.3, 0.7),
    "KshapePassive": (3, 6),
    "damping": (0.02, 0.2),
    "Af": (0.2, 0.4),
    "Flen": (1.2, 1.9),
}
RIGID = {"ignore_tendon_compliance": True}
# Class, ranges of random parameters, and further properties, by the name of the case.
CASES = {
    "coordinate": (
        "ActivationCoordinateActuator",
        {
            "optimal_force": (20, 300),
            "activation_time_constant": (0.005, 0.05),
            "default_activation": (-1, 1),
        },
        {"coordinate": "x"},
    ),
    "clutched": (
        "ClutchedPathSpring",
        {
            "stiffness": (100, 9000),
            "dissipation": (0, 0.5),
            "relaxation_time_constant": (0.001, 0.1),
            "initial_stretch": (0, 0.05),
        },
        {},
    ),
    "degroote": ("DeGrooteFregly2016Muscle", DEGROOTE, {}),
    "degroote, implicit": (
        "DeGrooteFregly2016Muscle",
        DEGROOTE,
        {"tendon_compliance_dynamics_mode": "implicit"},
    ),
    "degroote, rigid": ("DeGrooteFregly2016Muscle", DEGROOTE, RIGID),
    "degroote, rigid, without states": (
        "DeGrooteFregly2016Muscle",
        DEGROOTE,
        {**RIGID, "ignore_activation_dynamics": True, "ignore_passive_fiber_force": True},
    ),
    "meyer": ("MeyerFregly2016Muscle", {**SMOOTH, **TIMES}, RIGID),
    "rigid tendon": ("RigidTendonMuscle", HILL, {}),
    "schutte": ("Schutte1993Muscle_Deprecated", {**TIMED, "damping": (0.05, 0.2)}, {}),
    "schutte, passive curve": (
        "Schutte1993Muscle_Deprecated",
        {**TIMED, "damping": (0.05, 0.2)},
        {
            "passive_force_length_curve": SimmSpline(
                x=(0.0, 0.5, 1.0, 1.3, 2.0), y=(-0.1, 0.0, 0.05, 0.3, 2.0)
            )
        },
    ),
    "delp": ("Delp1990Muscle_Deprecated", {**TIMED, "mass": (0.002, 0.004)}, {}),
    "thelen, first form": ("Thelen2003Muscle_Deprecated", THELEN, {}),
}


def made(case, control):
    """Return a block that hangs on a random actuator, and the random generator.

    Args:
        case: key of `CASES`.
        control: constant control of the actuator.
    """
    name, bounds, more = CASES[case]
    rng = np.random.default_rng(len(case))
    component = find_class(name)
    if "geometry_path" in component.model_fields:
        more = {**more, "geometry_path": line()}
    numbers = {name: rng.uniform(*ends) for name, ends in bounds.items()}
    model = hung(component(name="mu", **numbers, **more), (control, control), gravity=9.80665)
    model.find("/jointset/slide/x").default_value = 0.33
    return model, rng


@pytest.fixture(autouse=True)
def quiet():
    """Turn off OpenSim's log, which has a line for each muscle that buckles or shortens too fast."""
    opensim.Logger.setLevelString("off")


@pytest.mark.parametrize("control", [0.0, 0.4, 1.3])
@pytest.mark.parametrize("case", CASES)
def test_derivatives_and_records(case, control, tmp_path):
    model, rng = made(case, control)
    osimlite.write(model, tmp_path / "model.osim")
    theirs = opensim.Model(str(tmp_path / "model.osim"))
    state = theirs.initSystem()
    mechanism = build_mechanism(model)
    engine = CompiledEngine(mechanism, force_elements(model, mechanism))
    named = [theirs.getStateVariableNames().get(k) for k in range(theirs.getNumStateVariables())]
    own = [path for path in named if path.startswith("/forceset/")]
    assert engine.state.paths == own
    assert engine.state.pack_defaults()[2:] == [
        theirs.getStateVariableValue(state, path) for path in own
    ]
    force, coordinate = theirs.getForceSet().get(0), theirs.getCoordinateSet().get(0)
    for _ in range(STATES):
        y = [rng.uniform(0.3, 0.37), rng.uniform(-0.4, 0.4)]
        y += [rng.uniform(*BOUNDS[path.rpartition("/")[2]]) for path in own]
        coordinate.setValue(state, y[0], False)
        for path, value in zip(own, y[2:], strict=True):
            theirs.setStateVariableValue(state, path, value)
        # Set the speed last: it makes OpenSim recompute what muscles cache of their states.
        coordinate.setSpeedValue(state, y[1])
        theirs.realizeAcceleration(state)
        expected = [theirs.getStateVariableDerivativeValue(state, path) for path in own]
        expected = [y[1], coordinate.getAccelerationValue(state), *expected]
        assert engine.compute_derivative(0.0, y) == pytest.approx(expected, rel=1e-9)
        labels, values = force.getRecordLabels(), force.getRecordValues(state)
        assert list(engine.columns) == [labels.get(k) for k in range(labels.getSize())]
        assert engine.force_records(0.0, y) == pytest.approx([values.get(0)], rel=1e-9, abs=1e-12)
        # OpenSim computes no potential energy for the deprecated muscles.
        if "Deprecated" not in CASES[case][0]:
            stored = theirs.calcPotentialEnergy(state) + MASS * 9.80665 * y[0]
            assert engine.compute_energies(0.0, y)[2] == pytest.approx(stored, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("case", CASES)
def test_states_and_steps(case, tmp_path):
    model, _ = made(case, 0.5)
    osimlite.write(model, tmp_path / "model.osim")
    # Stability limits the steps of the stiff Delp1990 muscle with mass, so that rounding errors
    # grow.
    end = 0.02 if case == "delp" else 0.2
    theirs = simulated(tmp_path / "model.osim", end, 1e-5, equilibrate=True)
    trajectory = osimlite.simulate(model, end, accuracy=1e-5, engine="compiled", equilibrate=True)
    trajectory.to_sto(tmp_path / "states.sto")
    ours = read_sto(tmp_path / "states.sto")
    assert ours.columns == theirs.columns
    assert trajectory.summary["steps"] == len(theirs.rows) - 1
    assert ours.rows[-1] == pytest.approx(
        theirs.rows[-1], rel=1e-9, abs=1e-9 * np.abs(theirs.rows[-1]).max()
    )


@pytest.mark.parametrize("case", CASES)
def test_states_of_what_is_off(case, tmp_path):
    """If the force is disabled, some states rest and others change as usual; no force acts."""
    model, _ = made(case, 0.5)
    actuator = model.find("/forceset/mu")
    actuator.appliesForce = False
    trajectory = osimlite.simulate(model, 0.05, accuracy=1e-5, engine="compiled")
    assert trajectory.forces == {}
    # OpenSim's ClutchedPathSpring ignores `appliesForce`, and its Delp1990Muscle cannot be computed
    # when disabled.
    if case in ("clutched", "delp"):
        assert trajectory.speeds[-1, 0] == pytest.approx(9.80665 * 0.05)
        return
    osimlite.write(model, tmp_path / "model.osim")
    theirs = simulated(tmp_path / "model.osim", 0.05, 1e-5, equilibrate=True)
    trajectory.to_sto(tmp_path / "states.sto")
    ours = read_sto(tmp_path / "states.sto")
    assert ours.columns == theirs.columns
    assert trajectory.summary["steps"] == len(theirs.rows) - 1
    assert ours.rows[-1] == pytest.approx(theirs.rows[-1], rel=1e-9)


def test_constants_of_the_first_muscle_count_for_all(tmp_path):
    """The time constants of the first muscle apply to all, as in an OpenSim process with this model only."""
    model, _ = made("degroote", 0.9)
    slow = {
        "activation_time_constant": 0.03,
        "deactivation_time_constant": 0.12,
        "activation_dynamics_smoothing": 5.0,
    }
    first = find_class("DeGrooteFregly2016Muscle")(name="first", geometry_path=line(), **slow)
    model.force_set.objects.insert(0, first)
    osimlite.write(model, tmp_path / "model.osim")
    program = """
import opensim
opensim.Logger.setLevelString("off")
model = opensim.Model("model.osim")
state = model.initSystem()
model.realizeAcceleration(state)
print(model.getStateVariableDerivativeValue(state, "/forceset/mu/activation"))
"""
    result = run_script(program, folder=tmp_path)
    mechanism = build_mechanism(model)
    engine = CompiledEngine(mechanism, force_elements(model, mechanism))
    y = engine.state.pack_defaults()
    rates = dict(zip(engine.state.paths, engine.compute_derivative(0.0, y)[2:], strict=True))
    assert rates["/forceset/mu/activation"] == pytest.approx(float(result.stdout), rel=1e-12)
