"""Tests of probes without OpenSim: error messages, columns of results, and kernels as Python."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite import Model
from osimlite.errors import DoubtfulWarning, ModelError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.schema.actuators import BodyActuator, CoordinateActuator
from osimlite.schema.muscles import Thelen2003Muscle
from osimlite.schema.probe_types import (
    ActuatorForceProbe,
    ActuatorPowerProbe,
    JointInternalPowerProbe,
    SystemEnergyProbe,
    Umberger2010MuscleMetabolicsProbe,
    Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameter,
)
from osimlite.simulation import Simulation, read_sto
from osimlite.simulation.batches import run_many
from osimlite.simulation.elements import force_elements
from osimlite.simulation.engines.linking import MACHINE_CODE, PYTHON_CODE
from osimlite.simulation.system import System
from tests.simulation.elements.muscle_rows import hung, line
from tests.simulation.support import arm


@pytest.fixture
def model() -> Model:
    made = arm()
    made.add(
        CoordinateActuator(name="motor", coordinate="q0"),
        BodyActuator(name="push", socket_body="/bodyset/b2"),
    )
    return made


def muscular(**more) -> Model:
    """Return a block on a muscle, with a probe that reports all muscles by name."""
    muscle = Thelen2003Muscle(
        name="mu", optimal_fiber_length=0.1, tendon_slack_length=0.2, geometry_path=line()
    )
    muscle.default_activation, muscle.default_fiber_length = 0.4, 0.1
    made = hung(muscle, (0.4, 0.4))
    made.find("/jointset/slide/x").default_value = 0.31
    probe = Umberger2010MuscleMetabolicsProbe(
        name="used", report_total_metabolics_only=False, **more
    )
    parameter = Umberger2010MuscleMetabolicsProbe_MetabolicMuscleParameter(name="mu")
    probe.metabolic_muscle_parameter_set.objects.append(parameter)
    made.add(probe)
    return made


@pytest.mark.parametrize(
    ("probe", "message"),
    [
        (
            ActuatorForceProbe(name="p", actuator_names=("moter",)),
            "'/probeset/p' names the actuator 'moter', which the model does not have; did you mean 'motor'?",
        ),
        (
            JointInternalPowerProbe(name="p", joint_names=("j00",)),
            "'/probeset/p' names the joint 'j00', which the model does not have; did you mean 'j0'?",
        ),
        (
            ActuatorForceProbe(name="p", actuator_names=("motor",), exponent=float("nan")),
            "'/probeset/p' has a parameter that is not a finite number; give it a finite value",
        ),
    ],
)
def test_what_opensim_stops_at(model, probe, message):
    model.add(probe.model_copy())
    with pytest.raises(ModelError) as caught:
        force_elements(model, build_mechanism(model))
    assert caught.value.message == message


@pytest.mark.parametrize(
    ("probe", "message"),
    [
        (
            ActuatorPowerProbe(name="p", actuator_names=("push",)),
            "'/probeset/p' (ActuatorPowerProbe of '/forceset/push', whose actuation is unknown)",
        ),
        (
            SystemEnergyProbe(name="p", probe_operation="integrate"),
            "'/probeset/p' (SystemEnergyProbe, whose integral osimlite does not compute)",
        ),
    ],
)
def test_what_is_left_out(model, probe, message):
    model.add(probe.model_copy(), SystemEnergyProbe(name="other"))
    with pytest.warns(DoubtfulWarning) as caught:
        trajectory = osimlite.simulate(model, to=0.01, engine="compiled")
    assert [str(item.message) for item in caught] == [f"left out of the results: {message}"]
    assert list(trajectory.probes) == ["other"]


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("name", "nu", "of the muscle 'nu', which the model does not have"),
        ("density", -1.0, "of the muscle 'mu', whose density is not positive"),
        (
            "use_provided_muscle_mass",
            True,
            "of the muscle 'mu', whose provided_muscle_mass is not positive",
        ),
        (
            "ratio_slow_twitch_fibers",
            1.5,
            "of the muscle 'mu', whose ratio_slow_twitch_fibers is not 0 to 1",
        ),
    ],
)
def test_metabolic_probes_that_opensim_switches_off(name, value, words):
    model = muscular()
    setattr(model.probe_set.objects[0].metabolic_muscle_parameter_set.objects[0], name, value)
    with pytest.warns(DoubtfulWarning) as caught:
        forces = force_elements(model, build_mechanism(model))
    told = f"left out of the results: '/probeset/used' (Umberger2010MuscleMetabolicsProbe {words})"
    assert [str(item.message) for item in caught] == [told]
    assert [element.path for element in forces.elements] == ["/forceset/mu"]


def test_columns_in_files(tmp_path):
    """Integrals of probes are columns of probes.sto, and not of the states, which have OpenSim's names."""
    trajectory = osimlite.simulate(muscular(probe_operation="integrate"), to=0.1)
    files = trajectory.write(tmp_path)
    assert tmp_path / "probes.sto" in files
    table = read_sto(tmp_path / "probes.sto")
    assert table.name == "ModelProbes"
    assert table.columns == ("used_TOTAL", "used_BASAL", "used_mu") == tuple(trajectory.probes)
    assert (table.rows == np.column_stack(list(trajectory.probes.values()))).all()
    assert (np.diff(table["used_mu"]) > 0.0).all()
    assert table["used_TOTAL"] == pytest.approx(table["used_BASAL"] + table["used_mu"], rel=1e-12)
    # The basal rate is 1.2 W/kg.
    assert table["used_BASAL"] == pytest.approx(1.2 * 20.0 * table.times, rel=1e-9)
    states = read_sto(tmp_path / "states.sto").columns
    own = ("/forceset/mu/activation", "/forceset/mu/fiber_length")
    assert states == ("/jointset/slide/x/value", "/jointset/slide/x/speed", *own)


def test_frames_have_columns_of_probes():
    pytest.importorskip("pandas", reason="needs pandas (extra 'frame')")
    trajectory = osimlite.simulate(muscular(), to=0.05)
    assert trajectory.to_frame()["used_mu"].tolist() == trajectory.probes["used_mu"].tolist()


def test_a_model_without_probes_has_no_file(model, tmp_path):
    files = osimlite.simulate(model, to=0.01).write(tmp_path)
    assert [path.name for path in files] == ["states.sto", "forces.sto", "summary.json"]


@pytest.mark.parametrize("operation", ["value", "integrate"])
def test_kernels_as_python(operation):
    model = muscular(probe_operation=operation)
    model.add(ActuatorPowerProbe(name="power", actuator_names=("all",), exponent=2.0))
    mechanism = build_mechanism(model)
    systems = [
        System(mechanism, force_elements(model, mechanism), code=code)
        for code in (MACHINE_CODE, PYTHON_CODE)
    ]
    state = systems[0].state.pack_defaults()
    first, second = (system.evaluate_probes(0.3, state) for system in systems)
    assert [len(row) for row in first] == [3, 1]
    for ours, theirs in zip(first, second, strict=True):
        assert ours == pytest.approx(theirs, rel=1e-13)
    derivatives = [system.compute_applied_forces(0.3, state) for system in systems]
    assert derivatives[0] == pytest.approx(derivatives[1], rel=1e-13, abs=1e-13)
    assert (derivatives[0][-3:] == first[0]) is (operation == "integrate")


def test_numbers_of_muscles_are_those_of_their_probes():
    """Changing only numbers of a model, as in a sweep, gives the same as building it anew."""
    model = muscular(probe_operation="integrate")
    with Simulation(model, "compiled") as ready:
        renewal = ready.engine.make_updater(model, Path())
        model.find("/forceset/mu").max_isometric_force = 300.0
        renewed = renewal.update([model.find("/forceset/mu")])
    with Simulation(model, "compiled") as whole:
        assert renewed.numbers.tolist() == whole.engine.numbers.tolist()
        start = [ready.state.pack_defaults()]
        runs = run_many(ready.engine, start, 0.1, numbers=renewed.numbers[None])
        assert (runs.states == run_many(whole.engine, start, 0.1).states).all()
