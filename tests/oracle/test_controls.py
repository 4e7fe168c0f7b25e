"""Compare controls that are read from files with a live OpenSim 4.6."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.errors import ModelError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.schema.actuators import BodyActuator, CoordinateActuator
from osimlite.schema.control_sets import ControlSetController
from osimlite.schema.controller_types import PrescribedController, SynergyController, SynergyVector
from osimlite.schema.examples import ToyReflexController
from osimlite.schema.function_types import Sine
from osimlite.schema.functions import Constant
from osimlite.schema.millard_muscles import RigidTendonMuscle
from osimlite.schema.reporters import SignalGenerator, TableSource__double_
from osimlite.simulation import write_sto
from osimlite.simulation.elements import force_elements
from osimlite.simulation.system import System
from osimlite.studies.sweep.plan import plan
from osimlite.studies.sweep.variants import Variants

opensim = pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

from tests.oracle.force_carrier import JOINTS, STATES, along, carrier, compare, drive  # noqa: E402


@pytest.fixture(params=list(JOINTS.values()), ids=list(JOINTS))
def model(request, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return carrier(request.param)


def compare_controls(path, times, tolerance=1e-12) -> None:
    """Compare the controls of all actuators of a model with OpenSim's at several times."""
    opensim.Logger.setLevelString("off")
    theirs = opensim.Model(str(path))
    state = theirs.initSystem()
    model = osimlite.read(path)
    mechanism = build_mechanism(model)
    system = System(mechanism, force_elements(model, mechanism, folder=path.parent))
    for time in times:
        state.setTime(time)
        theirs.realizeVelocity(state)
        system.compute_applied_forces(time, system.state.pack_defaults())
        expected = theirs.getControls(state).to_numpy()
        assert np.abs(system.read_controls() - expected).max() <= tolerance * max(
            1.0, np.abs(expected).max()
        )


# Times (s) before, within and after the data, and at their jumps.
TIMES = [-1.0, -0.1, 0.0, 0.013, 0.2, 0.3, 0.37, 0.5, 0.61, 0.99, 1.0, 1.7]


@pytest.mark.parametrize("interpolation", ["linear", "steps", "cubic"])
def test_controls_that_a_search_writes(tmp_path, interpolation):
    """OpenSim reads nodes, switches, a factor and a number as osimlite does, except exactly at steps."""
    model = carrier(next(iter(JOINTS.values())))
    first, second = (info.name for info in build_mechanism(model).coordinates[:2])
    motors(model, first, second)
    vary = {
        f"on_{first}/control@0:1.05:4": "-1:1", f"on_{first}/control@scale": "0:2", "on_*/control@switch1": "0:1",
        f"on_{second}/control@switch2": "0:1", f"on_{second}/control@switch3": "0:1", "on_*/control": "-1:1",
    }  # fmt: skip
    table = (np.array([0.1, 0.4, 0.9]), np.array([0.3, -0.2, 0.8]))
    made = plan(model, vary, controls={f"on_{first}": table}, interpolation=interpolation, to=1.0)
    variants = Variants(made)
    variants.apply_sample([0.3, -0.8, 0.5, 0.1, 1.7, 0.38, 0.38, 0.25, 0.45])
    osimlite.write(variants.model, tmp_path / "m.osim")
    compare_controls(tmp_path / "m.osim", TIMES)


def motors(model, *names) -> None:
    model.add(
        *(
            CoordinateActuator(name=f"on_{name}", coordinate=name, optimal_force=7.0)
            for name in names
        )
    )


@pytest.mark.parametrize("start", [-0.1, 0.37, 0.5])
@pytest.mark.parametrize("method", [None, 0, 1, 2, 3, 4, 5])
def test_controls_from_a_file(model, method, start, tmp_path):
    """The times lie within the table, at its start, and before it."""
    motors(model, "q0_0", "q1_0", "q2_0")
    times = np.linspace(start, 1.0, 23)
    rows = np.column_stack([np.sin((3.0 + k) * times + k) for k in range(2)])
    write_sto(
        tmp_path / "controls.sto",
        "controls",
        times,
        ["on_q0_0", "/forceset/on_q2_0"],
        rows.tolist(),
    )
    model.add(
        PrescribedController(
            name="brain", controls_file="controls.sto", interpolation_method=method
        )
    )
    assert compare(model, tmp_path) > 0
    # Splines of high degree lose digits far outside of the data.
    compare_controls(tmp_path / "model.osim", TIMES, 1e-11)


@pytest.mark.parametrize("method", [0, 1, 3])
def test_a_file_with_equal_times_and_labels(model, method, tmp_path):
    """The last of several rows at one time counts, and the first of several columns with one label."""
    motors(model, "q0_0")
    rows = [[float(number), 5.0] for number in range(6)]
    write_sto(
        tmp_path / "controls.sto",
        "controls",
        [0.0, 0.2, 0.37, 0.37, 0.4, 0.7],
        ["on_q0_0", "on_q0_0"],
        rows,
    )
    model.add(
        PrescribedController(
            name="brain", controls_file="controls.sto", interpolation_method=method
        )
    )
    assert compare(model, tmp_path) > 0


def test_a_column_beside_a_function_of_the_same_name(model, tmp_path):
    """A control function takes precedence over a column of the controls file."""
    model.add(CoordinateActuator(name="motor", coordinate="q1_0", optimal_force=7.0))
    write_sto(
        tmp_path / "controls.sto", "controls", [0.0, 1.0], ["/forceset/motor"], [[1.0], [2.0]]
    )
    brain = PrescribedController(
        name="brain", controls_file="controls.sto", socket_actuators=("/forceset/motor",)
    )
    brain.ControlFunctions.objects.append(Constant(value=5.0))
    model.add(brain)
    assert compare(model, tmp_path) > 0


def nodes(*points) -> str:
    return "".join(
        f"<ControlLinearNode><t>{t}</t><value>{x}</value></ControlLinearNode>" for t, x in points
    )


POINTS = {
    "around": nodes((-0.1, 1.0), (0.37, 2.0), (0.5, -1.0)),
    "within": nodes((-0.1, 1.0), (0.21, 2.0), (0.21, 4.0), (0.5, -1.0)),
    "later": nodes((0.5, 1.0), (0.7, 3.0)),
    "earlier": nodes((-0.1, 2.0), (0.3, -1.0)),
    "one": nodes((0.2, 5.0)),
}


@pytest.mark.parametrize("points", POINTS.values(), ids=POINTS)
@pytest.mark.parametrize(
    "more", ["", "<extrapolate>false</extrapolate>", "<use_steps>true</use_steps>"]
)
@pytest.mark.parametrize("enabled", [True, False])
def test_control_sets(model, enabled, more, points, tmp_path):
    """A ControlSetController is enabled by its set.

    Limits of controls, and controls for something else than the model, have no effect.
    """
    motors(model, "q0_0", "q1_0", "q2_0")
    curve = f"<default_max>0.5</default_max>{more}<x_nodes>{points}</x_nodes>"
    controls = (
        f'<ControlLinear name="on_q0_0">{curve}</ControlLinear>'
        f'<ControlLinear name="on_q1_0.excitation">{curve}</ControlLinear>'
        f'<ControlLinear name="on_q1_0"><x_nodes>{nodes((0.0, 100.0))}</x_nodes></ControlLinear>'
        '<ControlConstant name="on_q2_0"><value>9</value></ControlConstant>'
        '<ControlConstant name="on_q2_0"><is_model_control>true</is_model_control><value>3</value></ControlConstant>'
    )
    (tmp_path / "controls.xml").write_text(
        f'<OpenSimDocument Version="40600"><ControlSet name="set"><objects>{controls}</objects></ControlSet>'
        "</OpenSimDocument>"
    )
    brain = ControlSetController(
        name="brain",
        controls_file="controls.xml",
        socket_actuators=("/forceset/on_q0_0",),
        enabled=enabled,
    )
    model.add(brain)
    assert compare(model, tmp_path) == 3 * STATES
    compare_controls(tmp_path / "model.osim", TIMES)


def test_a_control_set_in_a_table(model, tmp_path):
    motors(model, "q0_0", "q1_0")
    rows = [[1.0, 2.0], [3.0, 5.0]]
    write_sto(
        tmp_path / "controls.sto", "controls", [0.0, 0.2], ["on_q0_0", "on_q1_0.excitation"], rows
    )
    model.add(ControlSetController(name="brain", controls_file="controls.sto"))
    assert compare(model, tmp_path) == 2 * STATES
    compare_controls(tmp_path / "model.osim", TIMES)


@pytest.mark.parametrize("frames", [(False, False), (True, False), (False, True)])
def test_synergies(model, frames, tmp_path):
    """Synergies combine signals and columns of tables, and add to the controls of other controllers.

    One of the actuators, a BodyActuator, has several controls.
    """
    motors(model, "q0_0", "q1_0")
    here, there = frames
    body = BodyActuator(name="push", socket_body="/bodyset/b1", point=(0.1, 0.2, 0.3))
    body.point_is_global, body.spatial_force_is_global = here, there
    model.add(body)
    drive(model, "on_q0_0", "on_q1_0")
    write_sto(
        tmp_path / "signals.sto",
        "signals",
        [0.0, 0.3, 0.5],
        ["a", "b"],
        [[0.0, 1.0], [2.0, -1.0], [1.0, 5.0]],
    )
    model.subcomponents += [
        SignalGenerator(name="wave", function=Sine(amplitude=2.0, omega=3.0, phase=0.1)),
        TableSource__double_(name="table", filename="signals.sto"),
    ]
    weights = [np.linspace(-1.0, 2.0, 8), np.linspace(3.0, 1.0, 8)]
    model.add(
        SynergyController(
            name="brain",
            socket_actuators=("/forceset/on_q1_0", "/forceset/push", "/forceset/on_q0_0"),
            input_controls=("/wave|signal", "/table|column:b(some)"),
            synergy_vectors=[SynergyVector(synergy_weights=tuple(row.tolist())) for row in weights],
        ),
        SynergyController(
            name="idle",
            socket_actuators=("/forceset/on_q0_0",),
            synergy_vectors=[SynergyVector(synergy_weights=(1.0,))],
        ),
    )
    assert compare(model, tmp_path) > 0
    compare_controls(tmp_path / "model.osim", [time for time in TIMES if 0.0 <= time <= 0.5])


def test_reflexes(model, tmp_path):
    """A reflex increases the control of a muscle that lengthens, which happens at some of the states.

    The control is the activation of this muscle class.
    """
    model.add(*along(RigidTendonMuscle, optimal_fiber_length=0.4, max_contraction_velocity=3.0))
    drive(model, "along0", "along1")
    for name, gain in (("first", 2.0), ("second", 3.0)):
        model.add(
            ToyReflexController(
                name=name, gain=gain, socket_actuators=("/forceset/along0", "/forceset/along1")
            )
        )
    assert compare(model, tmp_path, counted=None) == 2 * STATES


@pytest.mark.parametrize("words", ["on_q0_0", "on_q1_0 on_q0_0"])
def test_a_column_beside_a_function_of_the_same_name_in_an_old_document(model, words, tmp_path):
    motors(model, "q0_0", "q1_0")
    write_sto(
        tmp_path / "controls.sto",
        "controls",
        [0.0, 1.0],
        ["on_q0_0", "on_q1_0"],
        [[1.0, 4.0], [2.0, 7.0]],
    )
    brain = PrescribedController(
        name="brain", controls_file="controls.sto", socket_actuators=("/forceset/on_q0_0",)
    )
    brain.ControlFunctions.objects += [
        Constant(value=5.0 + number) for number in range(len(words.split()))
    ]
    model.add(brain)
    text = osimlite.to_text(model).replace('Version="40600"', 'Version="40500"')
    paths = "<socket_actuators>/forceset/on_q0_0</socket_actuators>"
    assert paths in text
    (tmp_path / "old.osim").write_text(
        text.replace(paths, f"<actuator_list>{words}</actuator_list>")
    )
    compare_controls(tmp_path / "old.osim", TIMES)


@pytest.mark.parametrize(
    ("label", "method", "words"),
    [
        ("moter", None, "the column 'moter' .* did you mean 'motor'"),
        ("motor", None, "by the column 'motor' and by another entry; remove one of them"),
        ("other", -1, "is -1, which is impossible with 2 rows"),
        ("other", 3, "is 3, which is impossible with 2 rows"),
    ],
)
def test_files_that_do_not_fit(label, method, words, tmp_path):
    """OpenSim rejects these files too."""
    model = carrier(JOINTS["pin, slider, universal"])
    for name, coordinate in (("motor", "q1_0"), ("other", "q0_0")):
        model.add(CoordinateActuator(name=name, coordinate=coordinate))
    write_sto(tmp_path / "controls.sto", "controls", [0.0, 1.0], [label], [[1.0], [2.0]])
    brain = PrescribedController(
        name="brain",
        controls_file="controls.sto",
        socket_actuators=("/forceset/motor",),
        interpolation_method=method,
    )
    brain.ControlFunctions.objects.append(Constant(value=5.0))
    model.add(brain)
    with pytest.raises(ModelError, match=words):
        force_elements(model, build_mechanism(model), folder=tmp_path)
