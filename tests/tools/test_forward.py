"""Tests of forward setups: initial states, steps, results and errors."""

from __future__ import annotations

import gzip
import re
from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.errors import OsimliteError
from osimlite.io.tables.storage import read_sto
from osimlite.simulation.initial_state import match_state_columns

SETUP = """<OpenSimDocument Version="40600">
    <ForwardTool name="fall">
        <model_file>model/walker.osim</model_file>
        <results_directory>results</results_directory>
        <output_precision>16</output_precision>
        <initial_time>0.25</initial_time>
        <final_time>0.3</final_time>
        <states_file>states.sto</states_file>
        <integrator_error_tolerance>1e-06</integrator_error_tolerance>
        <AnalysisSet name="Analyses"><objects>
            <Kinematics name="all"/>
            <Kinematics name="some"><step_interval>3</step_interval></Kinematics>
        </objects></AnalysisSet>
    </ForwardTool>
</OpenSimDocument>
"""


@pytest.fixture
def setup(fixtures: Path, tmp_path: Path) -> Path:
    """Write a setup that continues a motion of the walker."""
    (tmp_path / "model").mkdir()
    model = tmp_path / "model" / "walker.osim"
    model.write_bytes((fixtures / "walker" / "DynamicWalkerModel.osim").read_bytes())
    trajectory = osimlite.simulate(osimlite.read(model), to=0.4, accuracy=1e-6, report_interval=0.1)
    trajectory.write(tmp_path)
    (tmp_path / "setup.xml").write_text(SETUP)
    return tmp_path / "setup.xml"


def test_a_motion_goes_on_from_the_row_before(setup: Path) -> None:
    outcome = osimlite.run(setup)
    states = outcome.tables["fall_states.sto"]
    assert outcome.done and states.times[0] == pytest.approx(0.2) and states.times[-1] == 0.3
    before = read_sto(setup.parent / "states.sto")
    assert states.columns == before.columns and states.rows[0].tolist() == before.rows[2].tolist()
    # The steps differ, but the motion is the same.
    assert states.rows[-1] == pytest.approx(before.rows[3], abs=1e-4)
    degrees = outcome.tables["fall_states_degrees.mot"]
    turning = [name for name in states.columns if "knee" in name.lower()]
    assert turning and all(
        np.allclose(np.radians(degrees[name]), states[name], rtol=1e-14) for name in turning
    )
    # Without actuators, the table of controls has no rows, as in OpenSim.
    (empty,) = [path for path in outcome.files if path.name == "fall_controls.sto"]
    assert (
        empty.read_text()
        == "controls\nversion=1\nnRows=0\nnColumns=1\ninDegrees=no\nendheader\ntime\n"
    )
    every, some = (outcome.tables[f"fall_{name}_q.sto"] for name in ("all", "some"))
    assert every.times.tolist() == states.times.tolist()
    numbers = sorted({*range(0, len(every.times), 3), len(every.times) - 1})
    assert some.times.tolist() == every.times[numbers].tolist()


def test_steps_keep_their_bounds(setup: Path) -> None:
    setup.write_text(
        SETUP.replace(
            "<integrator_error",
            "<maximum_integrator_step_size>0.002</maximum_integrator_step_size>"
            "<minimum_integrator_step_size>0.001</minimum_integrator_step_size><integrator_error",
        )
    )
    steps = np.diff(osimlite.run(setup).tables["fall_states.sto"].times)[:-1]
    assert steps.min() >= 0.001 - 1e-15 and steps.max() <= 0.002 + 1e-15


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("1e-06", "0", "OpenSim does not finish with"),
        ("<final_time>0.3", "<final_time>0.2", "is not after the start, 0.2 s"),
        (
            "<integrator_error",
            "<maximum_integrator_step_size>0</maximum_integrator_step_size><integrator_error",
            "are invalid",
        ),
        ("states.sto", "degrees.sto", "OpenSim rejects states in degrees"),
        ("states.sto", "others.sto", "no column with a state of the model"),
        (
            "</objects></AnalysisSet>",
            "<StaticOptimization name='so'/></objects></AnalysisSet>",
            "needs a measured motion",
        ),
        (
            "<states_file>",
            "<ControllerSet><objects><CorrectionController name='cc'/></objects></ControllerSet><states_file>",
            "CorrectionController 'cc' yet; set <enabled>false",
        ),
    ],
)
def test_what_means_nothing_is_refused_and_nothing_is_written(
    setup: Path, old: str, new: str, said: str
) -> None:
    text = (setup.parent / "states.sto").read_text()
    (setup.parent / "degrees.sto").write_text(text.replace("inDegrees=no", "inDegrees=yes"))
    (setup.parent / "others.sto").write_text(re.sub(r"/\S+/(\S+)", r"other_\1", text))
    setup.write_text(SETUP.replace(old, new))
    with pytest.raises(OsimliteError, match=said):
        osimlite.run(setup, check=False)
    assert not (setup.parent / "results").exists()


def test_what_a_setup_adds_may_be_old(setup: Path, tmp_path: Path) -> None:
    """Old forces have obsolete properties, and a controller names all actuators by one word."""
    (tmp_path / "forces.xml").write_text(
        '<OpenSimDocument Version="20302"><ForceSet name="f"><objects><CoordinateActuator name="push">'
        "<coordinate>RKnee_rz</coordinate><optimal_force>2</optimal_force><max_force>3</max_force></CoordinateActuator>"
        "</objects></ForceSet></OpenSimDocument>"
    )
    controllers = (
        "<ControllerSet><objects><PrescribedController name='c'><actuator_list> all </actuator_list>"
        "<FunctionSet name='ControlFunctions'><objects><Constant><value>0.5</value></Constant></objects></FunctionSet>"
        "</PrescribedController></objects></ControllerSet>"
    )
    text = SETUP.replace("40600", "20302").replace("<states_file>", f"{controllers}<states_file>")
    setup.write_text(
        text.replace(
            "<output_precision>", "<force_set_files>forces.xml</force_set_files><output_precision>"
        )
    )
    table = osimlite.run(setup, check=False).tables["fall_controls.sto"]
    assert table.columns == ("push",) and len(table.times) > 1 and (table.rows == 0.5).all()


def test_labels_of_all_ages_are_states() -> None:
    paths = ["/jointset/knee/angle/value", "/jointset/knee/angle/speed", "/forceset/m/activation"]
    assert match_state_columns(paths, paths) == {path: k for k, path in enumerate(paths)}
    for labels in (
        ["knee/angle/value", "knee/angle/speed", "m/activation"],
        ["angle", "angle_u", "m.activation"],
        ["angle/value", "angle/speed", "activation"],
    ):
        assert match_state_columns(["other", *labels], paths) == {
            path: k + 1 for k, path in enumerate(paths)
        }
    assert match_state_columns(["x", "angle_v"], paths) == {}


def test_a_motion_with_muscles_and_controls_is_opensims(shared: Path, tmp_path: Path) -> None:
    """The model is arm26 with a ControlSet; the files equal OpenSim's to the last printed digit."""
    case = shared / "oracle" / "tools" / "reference" / "forward_arm26"
    for file in case.iterdir():
        content = gzip.decompress(file.read_bytes()) if file.suffix == ".gz" else file.read_bytes()
        (tmp_path / file.name.removesuffix(".gz")).write_bytes(content)
    outcome = osimlite.run(tmp_path / "fwd.xml")
    for name in ("arm26_states.sto", "arm26_controls.sto"):
        written = next(file for file in outcome.files if file.name == name)
        assert written.read_text() == (case / name).read_text()
