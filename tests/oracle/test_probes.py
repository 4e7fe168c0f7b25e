"""Compare probes with a live OpenSim 4.6: at random states, and with its ProbeReporter along a motion."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.mechanics.multibody import build_mechanism
from osimlite.schema.actuators import (
    CoordinateActuator,
)
from osimlite.schema.function_types import Sine
from osimlite.schema.millard_muscles import RigidTendonMuscle
from osimlite.schema.muscles import Thelen2003Muscle
from osimlite.schema.probe_types import (
    ActuatorForceProbe,
    ActuatorPowerProbe,
    Bhargava2004MuscleMetabolicsProbe,
    Bhargava2004MuscleMetabolicsProbe_MetabolicMuscleParameter,
    Bhargava2004SmoothedMuscleMetabolics,
    Bhargava2004SmoothedMuscleMetabolics_MuscleParameters,
    JointInternalPowerProbe,
    SystemEnergyProbe,
    Umberger2010MuscleMetabolicsProbe,
    Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameter,
)
from osimlite.schema.smooth_muscles import DeGrooteFregly2016Muscle
from osimlite.schema.splines import PiecewiseLinearFunction
from osimlite.simulation import Simulation
from osimlite.simulation.elements import force_elements
from osimlite.simulation.engines.protocol import EngineSettings
from osimlite.simulation.run_report import compute_probe_rows, list_probe_labels
from osimlite.simulation.system import System

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

from tests.oracle.force_carrier import JOINTS, STATES, TIME, along, carrier, drive  # noqa: E402
from tests.oracle.opensim_runs import put  # noqa: E402
from tests.oracle.support import OPERATIONS, add_actuators  # noqa: E402
from tests.simulation.elements.muscle_rows import hung, line  # noqa: E402


@pytest.fixture(params=list(JOINTS.values()), ids=list(JOINTS))
def model(request):
    return carrier(request.param)


def opened(model, tmp_path):
    opensim.Logger.setLevelString("off")
    osimlite.write(model, tmp_path / "model.osim")
    return opensim.Model(str(tmp_path / "model.osim"))


def compare(model, tmp_path, tolerance=1e-9):
    """Compare the outputs of all probes at random states, including auxiliary states."""
    theirs = opened(model, tmp_path)
    state = theirs.initSystem()
    mechanism = build_mechanism(model)
    system = System(mechanism, force_elements(model, mechanism))
    names = mechanism.coordinate_names
    rng = np.random.default_rng(7)
    for _ in range(STATES):
        q, u = rng.uniform(-0.9, 0.9, len(names)), rng.uniform(-2.0, 2.0, len(names))
        put(map(theirs.getCoordinateSet().get, names), state, q, u)
        z = rng.uniform(0.2, 0.8, len(system.state.variables))
        for path, value in zip(system.state.paths, z.tolist(), strict=True):
            theirs.setStateVariableValue(state, path, value)
        state.setTime(TIME)
        theirs.realizeReport(state)
        probes = [
            theirs.getProbeSet().get(number) for number in range(theirs.getProbeSet().getSize())
        ]
        expected = [
            probe.getProbeOutputs(state).to_numpy().tolist()
            for probe in probes
            if probe.isEnabled()
        ]
        result = system.evaluate_probes(TIME, system.state.pack(q.tolist(), u.tolist(), z.tolist()))
        result = [
            [probe.gain * x for x in row] for probe, row in zip(system.probes, result, strict=True)
        ]
        assert [len(row) for row in result] == [len(row) for row in expected]
        for ours, row in zip(result, expected, strict=True):
            scale = max([1.0, *(abs(x) for x in row if np.isfinite(x))])
            assert ours == pytest.approx(row, rel=tolerance, abs=tolerance * scale, nan_ok=True)


@pytest.mark.parametrize("exponent", [1.0, 2.0, 0.5, -2.0])
def test_forces_and_powers_of_actuators(model, exponent, tmp_path):
    add_actuators(model)
    for is_sum in (False, True):
        kinds = {"sum_forces_together": is_sum}, {"sum_powers_together": is_sum}
        for kind, more in zip((ActuatorForceProbe, ActuatorPowerProbe), kinds, strict=True):
            model.add(
                kind(
                    name=f"{kind.__name__}{is_sum}",
                    actuator_names=("all",),
                    exponent=exponent,
                    gain=3.0,
                    **more,
                )
            )
    model.add(ActuatorPowerProbe(name="some", actuator_names=("slow", "motor"), exponent=exponent))
    model.add(ActuatorForceProbe(name="disabled", actuator_names=("slow",), enabled=False))
    compare(model, tmp_path)


MUSCLES = {
    "thelen": (Thelen2003Muscle, {}),
    "degroote": (DeGrooteFregly2016Muscle, {"tendon_compliance_dynamics_mode": "implicit"}),
    "rigid": (RigidTendonMuscle, {}),
}
# Properties of metabolic probes of both classes.
SWITCHES: tuple[dict[str, object], ...] = (
    {},
    {"report_total_metabolics_only": False},
    {"forbid_negative_total_power": False, "report_total_metabolics_only": False},
    {"forbid_negative_total_power": False, "include_negative_mechanical_work": False, "gain": 2.0},
    {
        "forbid_negative_total_power": False,
        "enforce_minimum_heat_rate_per_muscle": False,
        "basal_rate_on": False,
    },
    {"shortening_rate_on": False, "muscle_effort_scaling_factor": 0.7, "basal_exponent": 0.5},
    {"mechanical_work_rate_on": False, "basal_coefficient": 2.0},
)
# Properties that only one of the two classes has.
OF_UMBERGER = (
    {"use_Bhargava_recruitment_model": False, "aerobic_factor": 1.0},
    {"activation_maintenance_rate_on": False, "forbid_negative_total_power": False},
)
OF_BHARGAVA = (
    {"use_force_dependent_shortening_prop_constant": True, "forbid_negative_total_power": False},
    {"activation_rate_on": False, "forbid_negative_total_power": False},
    {"maintenance_rate_on": False},
)


SMOOTH: tuple[dict[str, object], ...] = (
    {},
    {"forbid_negative_total_power": False, "include_negative_mechanical_work": False},
    {"use_force_dependent_shortening_prop_constant": True, "forbid_negative_total_power": False},
    {"use_smoothing": True},
    {"use_smoothing": True, "smoothing_type": "huber", "include_negative_mechanical_work": False},
    {
        "use_smoothing": True,
        "smoothing_type": "huber",
        "use_force_dependent_shortening_prop_constant": True,
    },
    {
        "use_smoothing": True,
        "velocity_smoothing": 3.0,
        "power_smoothing": 0.1,
        "heat_rate_smoothing": 0.2,
    },
)


def add_metabolics(
    model, names, kinds=(Umberger2010MuscleMetabolicsProbe, Bhargava2004MuscleMetabolicsProbe)
):
    """Add metabolic probes with all switches on and off for muscles with different parameters."""
    for kind in kinds:
        is_umberger = kind is Umberger2010MuscleMetabolicsProbe
        parameter = (
            Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameter
            if is_umberger
            else Bhargava2004MuscleMetabolicsProbe_MetabolicMuscleParameter
        )
        for number, switches in enumerate(
            (*SWITCHES, *(OF_UMBERGER if is_umberger else OF_BHARGAVA))
        ):
            probe = kind(name=f"{kind.__name__}{number}", **switches)
            if not is_umberger:
                probe.normalized_fiber_length_dependence_on_maintenance_rate = (
                    PiecewiseLinearFunction(
                        name="normalized_fiber_length_dependence_on_maintenance_rate",
                        x=(0.0, 0.5, 1.0, 1.5, 10.0),
                        y=(0.5, 0.5, 1.0, 0.1, 0.0),
                    )
                )
            for name, ratio, provided in zip(names, (0.5, 0.2), (False, True), strict=False):
                of_muscle = parameter(
                    name=name, ratio_slow_twitch_fibers=ratio, specific_tension=3e5, density=1100.0
                )
                of_muscle.use_provided_muscle_mass, of_muscle.provided_muscle_mass = provided, 0.3
                probe.metabolic_muscle_parameter_set.objects.append(of_muscle)
            model.add(probe)


@pytest.mark.parametrize("muscle", MUSCLES)
def test_metabolic_powers(model, muscle, tmp_path):
    kind, more = MUSCLES[muscle]
    muscles = along(kind, **more)
    # One muscle shortens while the other lengthens, on different sides of the optimal fiber length.
    muscles[0].optimal_fiber_length, muscles[1].optimal_fiber_length = 0.2, 2.0
    model.add(*muscles)
    drive(model, "along0", "along1")
    add_metabolics(model, ("along0", "along1"))
    compare(model, tmp_path)


@pytest.mark.parametrize("switches", SMOOTH, ids=str)
def test_smooth_metabolic_powers(model, switches, tmp_path):
    muscles = along(RigidTendonMuscle)
    muscles[0].optimal_fiber_length, muscles[1].optimal_fiber_length = 0.2, 2.0
    model.add(*muscles)
    drive(model, "along0", "along1")
    metabolics = Bhargava2004SmoothedMuscleMetabolics(
        name="used", muscle_effort_scaling_factor=0.7, **switches
    )
    for muscle in muscles:
        parameters = Bhargava2004SmoothedMuscleMetabolics_MuscleParameters(
            name=muscle.name, socket_muscle=muscle
        )
        metabolics.muscle_parameters.append(parameters)
    model.subcomponents.append(metabolics)
    theirs = opened(model, tmp_path)
    state = theirs.initSystem()
    mechanism = build_mechanism(model)
    system = System(mechanism, force_elements(model, mechanism))
    names, rng = mechanism.coordinate_names, np.random.default_rng(7)
    (outputs,) = (item for item in theirs.getComponentsList() if item.getName() == "used")
    totals = "Metabolic", "Activation", "Maintenance", "Shortening", "MechanicalWork"
    for _ in range(STATES):
        q, u = rng.uniform(-0.9, 0.9, len(names)), rng.uniform(-2.0, 2.0, len(names))
        put(map(theirs.getCoordinateSet().get, names), state, q, u)
        state.setTime(TIME)
        theirs.realizeReport(state)
        expected = [getattr(outputs, f"getTotal{total}Rate")(state) for total in totals]
        expected += [
            outputs.getMuscleMetabolicRate(state, f"/forceset/along{number}") for number in (0, 1)
        ]
        (result,) = system.evaluate_probes(TIME, system.state.pack(q.tolist(), u.tolist()))
        assert result == pytest.approx(expected, rel=1e-9, abs=1e-9)
    ends = ["metabolic", "activation", "maintenance", "shortening", "mechanical_work"]
    labels = [f"/used|total_{end}_rate" for end in ends]
    labels += [f"/used|muscle_metabolic_rate:/forceset/along{number}" for number in (0, 1)]
    assert list_probe_labels(system.probes) == labels


def reported(model, tmp_path, to, accuracy):
    """Return labels, times and rows of OpenSim's ProbeReporter along a motion."""
    theirs = opened(model, tmp_path)
    theirs.addAnalysis(opensim.ProbeReporter(theirs))
    state = theirs.initSystem()
    manager = opensim.Manager(theirs)
    manager.setIntegratorAccuracy(accuracy)
    manager.initialize(state)
    manager.integrate(to)
    storage = theirs.getAnalysisSet().get(0).getStorageList().get(0)
    rows = [storage.getStateVector(number) for number in range(storage.getSize())]
    labels = storage.getColumnLabels()
    return (
        [labels.get(number) for number in range(1, labels.getSize())],
        [row.getTime() for row in rows],
        [[row.getData().get(number) for number in range(row.getData().getSize())] for row in rows],
    )


def compare_motion(model, tmp_path, to=0.3, accuracy=1e-5):
    """Compare the times of steps, the labels and the probe outputs at the ends of the steps."""
    labels, times, rows = reported(model, tmp_path, to, accuracy)
    if any(probe.probe_operation == "differentiate" for probe in model.probe_set.objects):
        # Simbody computes the first rate from uninitialised memory.
        rows[0] = [0.0] * len(labels)
    with Simulation(model, "compiled") as ready:
        steps = []
        stepper = ready.engine.make_stepper(
            0.0,
            ready.initial_state({}, {}),
            EngineSettings(accuracy=accuracy),
            lambda t, y: steps.append((t, y)),
        )
        steps.append((stepper.time, stepper.state))
        stepper.tabulate([to])
        stepper.catch_up()
        result = np.array(list(compute_probe_rows(ready.engine, steps, steps)))
        assert list_probe_labels(ready.engine.probes) == labels
        assert [t for t, _ in steps] == pytest.approx(times, abs=1e-9)
        # A second-order rate is twice a difference of neighbouring values minus the previous rate,
        # so that rounding errors accumulate. Compare relative to the largest value of a column.
        scale = np.maximum(1.0, np.abs(rows).max(axis=0))
        assert np.abs((result - rows) / scale).max() <= 1e-9
        trajectory = ready.run(to, accuracy=accuracy)
        assert list(trajectory.probes) == labels
        ends = np.array([column[[0, -1]] for column in trajectory.probes.values()])
        assert np.abs((ends - np.array(rows)[[0, -1]].T) / scale[:, None]).max() <= 1e-9


@pytest.mark.parametrize("operation", OPERATIONS)
def test_operations_along_a_motion(model, operation, tmp_path):
    """SystemEnergyProbe is left out for `integrate`, which OpenSim does not support for it."""
    model.add(
        *(CoordinateActuator(name=f"on_{name}", coordinate=name) for name in ("q0_0", "q1_0"))
    )
    drive(model, "on_q0_0", "on_q1_0")
    for number, start in enumerate(((3.0, 2.0), (), (1.0,))):
        probe = ActuatorPowerProbe(
            name=f"p{number}", actuator_names=("all",), probe_operation=operation, gain=2.0
        )
        probe.initial_conditions_for_integration = start
        model.add(probe)
    if operation != "integrate":
        model.add(SystemEnergyProbe(name="all", probe_operation=operation))
        model.add(
            SystemEnergyProbe(
                name="kinetic", compute_potential_energy=False, probe_operation=operation
            )
        )
    compare_motion(model, tmp_path)


@pytest.mark.parametrize("operation", ["value", "integrate", "differentiate"])
def test_metabolic_powers_along_a_motion(operation, tmp_path):
    """Integrals are states, whose errors take part in the step size control."""
    numbers = {
        "max_isometric_force": 546.0,
        "optimal_fiber_length": 0.0535,
        "tendon_slack_length": 0.272,
    }
    more = {"default_activation": 0.4, "default_fiber_length": 0.05, "geometry_path": line()}
    model = hung(Thelen2003Muscle(name="mu", **numbers, **more), (0.4, 0.4), gravity=9.80665)
    model.find("/jointset/slide/x").default_value = 0.33
    add_metabolics(model, ("mu",))
    for probe in model.probe_set.objects:
        probe.probe_operation = operation
    compare_motion(model, tmp_path)


@pytest.mark.parametrize("is_sum", [False, True])
def test_powers_of_prescribed_motions(is_sum, tmp_path):
    model = carrier(JOINTS["pin, slider, universal"])
    for name, joint in (("q0_0", "j0"), ("q2_1", "j2")):
        coordinate = model.find(f"/jointset/{joint}/{name}")
        coordinate.prescribed, coordinate.prescribed_function = (
            True,
            Sine(amplitude=0.4, omega=3.0, phase=0.2),
        )
    model.add(CoordinateActuator(name="motor", coordinate="q0_0", optimal_force=7.0))
    drive(model, "motor")
    probe = JointInternalPowerProbe(
        name="joints", joint_names=("all",), sum_powers_together=is_sum, exponent=2.0
    )
    model.add(probe, JointInternalPowerProbe(name="last", joint_names=("j2", "j1")))
    compare_motion(model, tmp_path)
