"""Tests of controls as arguments of a run: their effect, repeated runs, and error messages."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite import Model
from osimlite.errors import DoubtfulWarning, OsimliteError, SimulationError
from osimlite.mechanics.multibody.functions import SineWave
from osimlite.schema.actuators import BodyActuator, CoordinateActuator
from osimlite.schema.controller_types import PrescribedController, SynergyController, SynergyVector
from osimlite.schema.functions import Constant, LinearFunction
from osimlite.schema.reporters import TableSource__double_
from osimlite.simulation import Simulation, StoTable, read_sto, write_sto
from osimlite.simulation.engines.linking import MACHINE_CODE, PYTHON_CODE
from osimlite.simulation.run_controls import add_controls
from osimlite.simulation.system import System
from tests.simulation.support import arm

TIMES, VALUES = (0.0, 0.1, 0.3), (1.0, 3.0, -1.0)


@pytest.fixture(scope="module")
def model() -> Model:
    """Return a model with three actuators; a controller of the model drives the first one."""
    made = arm()
    made.add(
        CoordinateActuator(name="first", coordinate="q0"),
        CoordinateActuator(name="second", coordinate="q1"),
    )
    made.add(BodyActuator(name="push", socket_body="/bodyset/b2"))
    brain = PrescribedController(name="brain", socket_actuators=("/forceset/first",))
    brain.ControlFunctions.objects.append(Constant(value=0.5))
    made.add(brain)
    return made


@pytest.fixture(scope="module", params=["bullet", "compiled"])
def ready(request, model):
    with Simulation(model, request.param, fixed_step=1e-3, report_interval=0.02) as simulation:
        yield simulation


def controls_of(ready, given) -> tuple[np.ndarray, np.ndarray]:
    """Run a simulation with these controls.

    Returns:
        Times, and the controls of the first two actuators by the forces that they exert (2, t).
    """
    trajectory = ready.run(0.3, controls=given)
    return trajectory.times, np.array([trajectory.forces[name] for name in ("first", "second")])


def at(times, values) -> np.ndarray:
    return np.interp(times, TIMES, values)


GIVEN = {
    "number": (2, lambda t: 2.0 + 0.0 * t),
    "text": ("2.5", lambda t: 2.5 + 0.0 * t),
    "times": ((TIMES, VALUES), lambda t: at(t, VALUES)),
    "one time": (([0.1], [4.0]), lambda t: 4.0 + 0.0 * t),
    "function": (SineWave(2.0, 3.0, 0.1, 0.2), lambda t: 2.0 * np.sin(3.0 * t + 0.1) + 0.2),
    "component": (LinearFunction(coefficients=(3.0, 1.0)), lambda t: 3.0 * t + 1.0),
    "callable": (lambda t: t * t, lambda t: t * t),
}


@pytest.mark.filterwarnings("ignore::osimlite.errors.DoubtfulWarning")
@pytest.mark.parametrize(("given", "expected"), GIVEN.values(), ids=GIVEN)
def test_what_a_control_may_be(ready, given, expected):
    """A control is added to that of the model; without either it is 0. The next run does not use it."""
    times, result = controls_of(ready, {"first": given, "/forceset/push_4": 1.0})
    assert result == pytest.approx(np.array([0.5 + expected(times), 0.0 * times]), abs=1e-12)
    times, result = controls_of(ready, None)
    assert result.tolist() == [[0.5] * len(times), [0.0] * len(times)]


def test_a_motion_is_that_of_a_controller_more(model, tmp_path):
    rows = np.column_stack((VALUES, [0.1, 0.2, -0.3]))
    write_sto(
        tmp_path / "controls.sto", "controls", TIMES, ["first", "/forceset/second"], rows.tolist()
    )
    with_controller = model.model_copy(deep=True)
    with_controller.add(PrescribedController(name="more", controls_file="controls.sto"))
    expected = osimlite.simulate(with_controller, to=0.3, engine="compiled", folder=tmp_path)
    with Simulation(model, "compiled") as ready:
        for given in (
            tmp_path / "controls.sto",
            str(tmp_path / "controls.sto"),
            read_sto(tmp_path / "controls.sto"),
        ):
            assert (ready.run(0.3, controls=given).values == expected.values).all()
    assert (expected.values != osimlite.simulate(model, to=0.3, engine="compiled").values).any()


def test_a_trajectory_keeps_the_controls_of_its_run(model):
    """Forces and energies are computed when they are read, possibly after another run."""
    with Simulation(model, "compiled") as ready:
        first, second = (ready.run(0.1, controls={"second": value}) for value in (1.0, 2.0))
    assert (first.forces["second"] == 1.0).all()
    assert (second.forces["second"] == 2.0).all()
    assert first.summary["settings"]["controls"] == {"second": 1.0}


def test_a_control_set_can_be_given(model, tmp_path):
    (tmp_path / "set.xml").write_text(
        '<OpenSimDocument Version="40600"><ControlSet><objects><ControlLinear name="second.excitation"><x_nodes>'
        "<ControlLinearNode><value>7</value></ControlLinearNode></x_nodes></ControlLinear></objects></ControlSet>"
        "</OpenSimDocument>"
    )
    forces = osimlite.simulate(
        model, to=0.1, engine="compiled", controls=tmp_path / "set.xml"
    ).forces
    assert (forces["second"] == 7.0).all()


@pytest.mark.parametrize("code", [MACHINE_CODE, PYTHON_CODE], ids=lambda code: code.name)
def test_the_kernel_alone(model, code):
    mechanism = osimlite.mechanism(model)
    forces = osimlite.simulation.elements.force_elements(model, mechanism)
    system = System(mechanism, forces, code=code)
    for given in (
        {"first": SineWave(2.0, 3.0, 0.1, 0.2)},
        {"first": lambda t: 2.0},
        {"second": 1.0, "push_0": 3.0},
        {},
    ):
        system.set_controls(add_controls(forces.controls, given, 1.0))
        functions = add_controls(forces.controls, given, 1.0).functions
        expected = [
            sum(float(item.evaluate(np.array((0.7,)))[0]) for item in row) for row in functions
        ]
        system.compute_applied_forces(0.7, system.state.pack_defaults())
        assert system.read_controls() == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"secund": 1.0}, "the model has no actuator 'secund' to control; did you mean 'second'?"),
        (
            {"second": 1.0, "/forceset/second": 2.0},
            "'/forceset/second' is controlled twice, by its name and by its path; leave one out",
        ),
        (
            StoTable("Controls", np.array((0.0, 1.0)), ("second", "second"), np.zeros((2, 2))),
            "the table of controls has two columns 'second'; leave one out",
        ),
        ({"second": float("nan")}, "the control of 'second' is nan; give a number"),
        (
            {"second": "much"},
            "the control of 'second' is 'much'; give a number, a function of time or (times, values)",
        ),
        (
            {"second": [1.0]},
            "the control of 'second' is [1.0]; give a number, a function of time or (times, values)",
        ),
        (
            {"second": ([0.0, 1.0], [1.0])},
            "the control of 'second' has 2 times, but 1 value; give one value for each time",
        ),
        (
            {"second": (0.5, 1.0)},
            "the control of 'second' has times of shape () and values of shape (); give two lists of numbers",
        ),
        (
            {"second": ([0.0, 1.0], [[1.0], [2.0]])},
            "the control of 'second' has times of shape (2,) and values of shape (2, 1); give two lists of numbers",
        ),
        (
            {"second": ([0.0, "soon"], [1.0, 2.0])},
            "the control of 'second' has a time or value that is not a number "
            "(could not convert string to float: 'soon'); correct it",
        ),
        (
            {"second": ([], [])},
            "the control of 'second' has no times; give at least one time and value",
        ),
        (
            {"second": ([0.0, 0.0], [1.0, 2.0])},
            "the control of 'second' has times that do not increase, or a value that is not a finite number; correct it",
        ),
        (
            {"second": ([0.0, 1.0], [1.0, float("inf")])},
            "the control of 'second' has times that do not increase, or a value that is not a finite number; correct it",
        ),
        (
            {"second": lambda t: float("nan")},
            "the control of 'second' is nan at 0 s; give a number",
        ),
        ("gone.sto", "cannot read the file: no such file"),
        (0.5, "controls are a mapping of names, a table or a file, not 0.5"),
    ],
)
def test_faults(ready, given, message):
    with pytest.raises(OsimliteError) as caught:
        ready.run(0.1, controls=given)
    assert caught.value.message == message


def test_names_that_two_actuators_share(model):
    twice = model.model_copy(deep=True)
    twice.subcomponents.append(CoordinateActuator(name="second", coordinate="q2"))
    message = "2 actuators are called 'second': /second and /forceset/second; give the path of one"
    with pytest.raises(OsimliteError, match=message):
        osimlite.simulate(twice, to=0.1, engine="compiled", controls={"second": 1.0})
    osimlite.simulate(twice, to=0.1, engine="compiled", controls={"/second": 1.0})


def test_tables_that_do_not_cover_the_motion(ready):
    message = "the controls cover only 0.1 to 0.2 s of the motion, which goes from 0 to 0.3 s; outside, the first and last values"
    with pytest.warns(DoubtfulWarning, match=message):
        times, result = controls_of(
            ready, {"second": ((0.1, 0.2), (1.0, 2.0)), "first": ((0.0, 0.3), (0.0, 0.0))}
        )
    assert result[1] == pytest.approx(np.interp(times, (0.1, 0.2), (1.0, 2.0)), abs=1e-12)


def test_a_table_source_that_does_not_cover_the_motion(model, tmp_path):
    fed = model.model_copy(deep=True)
    write_sto(tmp_path / "table.sto", "table", [0.0, 0.2], ["a"], [[1.0], [2.0]])
    fed.subcomponents.append(TableSource__double_(name="table", filename="table.sto"))
    vectors = [SynergyVector(synergy_weights=(1.0,))]
    fed.add(
        SynergyController(
            name="spread",
            socket_actuators=("/forceset/second",),
            input_controls=("/table|column:a",),
            synergy_vectors=vectors,
        )
    )
    osimlite.simulate(fed, to=0.2, engine="compiled", folder=tmp_path)
    message = (
        "the table of '/table' goes from 0 to 0.2 s, but the motion from 0 to 0.3 s; "
        "OpenSim fails outside the table, so extend the table"
    )
    with pytest.raises(SimulationError, match=message):
        osimlite.simulate(fed, to=0.3, engine="compiled", folder=tmp_path)
