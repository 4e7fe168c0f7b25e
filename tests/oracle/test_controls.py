"""Controls from files against a live OpenSim 4.6."""

from __future__ import annotations

import numpy as np
import pytest

from osimlite.errors import ModelError
from osimlite.multibody import build_mechanism
from osimlite.schema.actuators import CoordinateActuator
from osimlite.schema.controller_types import PrescribedController
from osimlite.schema.functions import Constant
from osimlite.simulation import write_sto
from osimlite.simulation.elements import force_elements

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytest.importorskip("pybullet", reason="needs pybullet (extra 'bullet')")
pytestmark = pytest.mark.oracle

from tests.oracle.force_carrier import JOINTS, carrier, compare  # noqa: E402


@pytest.fixture(params=list(JOINTS.values()), ids=list(JOINTS))
def model(request, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return carrier(request.param)


def motors(model, *names) -> None:
    model.add(*(CoordinateActuator(name=f"on_{name}", coordinate=name, optimal_force=7.0) for name in names))


@pytest.mark.parametrize("start", [-0.1, 0.37, 0.5])
@pytest.mark.parametrize("method", [None, 0, 1, 2, 3, 4, 5])
def test_controls_from_a_file(model, method, start, tmp_path):
    """At a time within the table, at its start, and before it."""
    motors(model, "q0_0", "q1_0", "q2_0")
    times = np.linspace(start, 1.0, 23)
    rows = np.column_stack([np.sin((3.0 + k) * times + k) for k in range(2)])
    write_sto(tmp_path / "controls.sto", "controls", times, ["on_q0_0", "/forceset/on_q2_0"], rows.tolist())
    model.add(PrescribedController(name="brain", controls_file="controls.sto", interpolation_method=method))
    assert compare(model, tmp_path) > 0


@pytest.mark.parametrize("method", [0, 1, 3])
def test_a_file_with_equal_times_and_labels(model, method, tmp_path):
    """The last row at a time counts, and the first column of a label."""
    motors(model, "q0_0")
    rows = [[float(number), 5.0] for number in range(6)]
    write_sto(tmp_path / "controls.sto", "controls", [0.0, 0.2, 0.37, 0.37, 0.4, 0.7], ["on_q0_0", "on_q0_0"], rows)
    model.add(PrescribedController(name="brain", controls_file="controls.sto", interpolation_method=method))
    assert compare(model, tmp_path) > 0


def test_a_column_beside_a_function_of_the_same_name(model, tmp_path):
    """The function counts, and the column does not."""
    model.add(CoordinateActuator(name="motor", coordinate="q1_0", optimal_force=7.0))
    write_sto(tmp_path / "controls.sto", "controls", [0.0, 1.0], ["/forceset/motor"], [[1.0], [2.0]])
    brain = PrescribedController(name="brain", controls_file="controls.sto", socket_actuators=("/forceset/motor",))
    brain.ControlFunctions.objects.append(Constant(value=5.0))
    model.add(brain)
    assert compare(model, tmp_path) > 0


@pytest.mark.parametrize(
    ("label", "method", "words"),
    [
        ("moter", None, "the column 'moter' .* did you mean 'motor'"),
        ("motor", None, "by the column 'motor' and otherwise too; leave one out"),
        ("other", -1, "is -1, which 2 rows do not allow"),
        ("other", 3, "is 3, which 2 rows do not allow"),
    ],
)
def test_files_that_do_not_fit(label, method, words, tmp_path):
    """OpenSim refuses these too."""
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
