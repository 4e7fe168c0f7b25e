"""Tests of controllers with contradictory properties, and of faulty files of controls."""

from __future__ import annotations

import pytest

import osimlite
from osimlite import Model
from osimlite.errors import OsimliteError, UnsupportedError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.schema.actuators import CoordinateActuator
from osimlite.schema.control_sets import ControlSetController
from osimlite.schema.controller_types import PrescribedController, SynergyController, SynergyVector
from osimlite.schema.examples import ToyPropMyoController, ToyReflexController
from osimlite.schema.functions import Constant
from osimlite.schema.reporters import SignalGenerator, TableSource__double_
from osimlite.simulation import write_sto
from osimlite.simulation.elements import force_elements
from tests.simulation.support import arm


def told(model: Model, folder) -> OsimliteError:
    with pytest.raises(OsimliteError) as caught:
        force_elements(model, build_mechanism(model), folder=folder)
    return caught.value


@pytest.fixture
def model() -> Model:
    made = arm()
    made.add(CoordinateActuator(name="motor", coordinate="q0"))
    return made


HEAD = "controls\nversion=1\nnRows=2\nnColumns=3\ninDegrees=no\nendheader\ntime\tmotor\tother\n"


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ("0\t1\t2\n0.1\tnan\t2\n", "controls.sto:9:5: 'motor' is nan; give a number"),
        ("0\t1\t2\n0.1\t1\tinf\n", "controls.sto:9:7: 'other' is inf; give a number"),
        (
            "0.5\t1\t2\n0.1\t1\t2\n",
            "controls.sto:9: the time goes back from 0.5 to 0.1 s; sort the rows",
        ),
        ("0\t1\n", "controls.sto:8:4: the row has 2 numbers and needs 3"),
        ("0\t1\tx\n", "controls.sto:8:5: 'x' is not a number"),
        ("", "controls.sto:7: the table has no rows; add at least one"),
        (
            "0\t1\t2\n1\t1\t2\n",
            "controls.sto: the column 'other' of the file of '/controllerset/brain' is not an actuator of the model; "
            "did you mean 'motor'?",
        ),
    ],
)
def test_faults_of_tables(model, rows, message, tmp_path):
    (tmp_path / "controls.sto").write_text(HEAD + rows)
    model.add(PrescribedController(name="brain", controls_file="controls.sto"))
    assert str(told(model, tmp_path)).removeprefix(f"{tmp_path}/") == message


def nodes(*times) -> str:
    return "".join(f"<ControlLinearNode><t>{t}</t></ControlLinearNode>" for t in times)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            f'<ControlLinear name="moter"><x_nodes>{nodes(0)}</x_nodes></ControlLinear>',
            "'/controllerset/brain' has no actuator for the control 'moter' of its file; did you mean 'motor'?",
        ),
        ('<ControlLinear name="motor"/>', "the control 'motor' has no x_nodes; add at least one"),
        (
            f'<ControlLinear name="motor"><x_nodes>{nodes(0, 2, 1)}</x_nodes></ControlLinear>',
            "the x_nodes of the control 'motor' go back in time or are not finite; sort and correct them",
        ),
    ],
)
def test_faults_of_control_sets(model, text, message, tmp_path):
    (tmp_path / "set.xml").write_text(
        f'<OpenSimDocument Version="40600"><ControlSet><objects>{text}</objects></ControlSet></OpenSimDocument>'
    )
    model.add(ControlSetController(name="brain", controls_file="set.xml"))
    error = told(model, tmp_path)
    assert (error.file, error.message) == (str(tmp_path / "set.xml"), message)


def test_a_control_set_that_is_not_there(model, tmp_path):
    model.add(ControlSetController(name="brain", controls_file="set.xml"))
    assert told(model, tmp_path).message == "cannot read the file: no such file"


def test_a_control_set_that_is_not_named_does_nothing(model, tmp_path):
    model.add(ControlSetController(name="brain"))
    assert force_elements(model, build_mechanism(model)).controls.functions == ((),)


def synergies(inputs, weights) -> SynergyController:
    vectors = [SynergyVector(name="v", synergy_weights=weights)]
    name = ("/forceset/motor",)
    return SynergyController(
        name="brain", socket_actuators=name, input_controls=inputs, synergy_vectors=vectors
    )


@pytest.mark.parametrize(
    ("inputs", "weights", "message"),
    [
        (
            ("/wave|signal",),
            (1.0, 2.0),
            "the synergy vector 'v' of '/controllerset/brain' has 2 weights for 1 control; give it one for each",
        ),
        (
            ("/wave|signal", "/wave|signal"),
            (1.0,),
            "'/controllerset/brain' has 2 inputs for 1 synergy vector; give it one for each",
        ),
        (
            ("/waves|signal",),
            (1.0,),
            "an input of '/controllerset/brain' names '/waves|signal', which the model does not have; "
            "run 'osimlite validate'",
        ),
        (("/table|column:aa",), (1.0,), "'/table' has no column 'aa'; did you mean 'a'?"),
    ],
)
def test_faults_of_synergies(model, inputs, weights, message, tmp_path):
    write_sto(tmp_path / "table.sto", "table", [0.0, 1.0], ["a"], [[1.0], [2.0]])
    model.subcomponents += [
        SignalGenerator(name="wave"),
        TableSource__double_(name="table", filename="table.sto"),
    ]
    model.add(synergies(inputs, weights))
    assert told(model, tmp_path).message == message


def test_a_synergy_of_what_is_no_function_of_time(model, tmp_path):
    model.add(synergies(("/jointset/j0/q0|value",), (1.0,)))
    error = told(model, tmp_path)
    assert isinstance(error, UnsupportedError)
    assert (
        "driven by '/controllerset/brain', whose input '/jointset/j0/q0|value' is not a known function of time"
        in str(error)
    )


def test_controllers_of_the_examples(model, tmp_path):
    brain = ToyReflexController(name="brain", socket_actuators=("/forceset/motor",))
    model.add(brain)
    message = (
        "'/controllerset/brain' drives '/forceset/motor', which is not a muscle; name muscles only"
    )
    assert told(model, tmp_path).message == message
    brain.enabled = False
    model.add(ToyPropMyoController(name="myo", socket_actuator="/forceset/motor"))
    message = "driven by the ToyPropMyoController '/controllerset/myo', whose control follows an activation"
    assert message in told(model, tmp_path).message


def test_an_actuator_of_a_class_that_nobody_knows(tmp_path):
    model = arm()
    model.add(CoordinateActuator(name="motor", coordinate="q0"))
    brain = PrescribedController(
        name="brain", socket_actuators=("/forceset/motor", "/forceset/piston")
    )
    brain.ControlFunctions.objects += [Constant(value=1.0), Constant(value=2.0)]
    model.add(brain)
    text = osimlite.to_text(model).replace(
        "<CoordinateActuator", '<Piston name="piston"/><CoordinateActuator', 1
    )
    (tmp_path / "model.osim").write_text(text)
    read = osimlite.read(tmp_path / "model.osim")
    assert "'/forceset/piston' (Piston)" in told(read, tmp_path).message
    forces = force_elements(read, build_mechanism(read), skip_unsupported=True)
    assert forces.controls.names == ("/forceset/motor",)
    assert [len(functions) for functions in forces.controls.functions] == [1]
