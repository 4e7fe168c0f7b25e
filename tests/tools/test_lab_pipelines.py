"""Tests of pipelines of labs: messages about them, and files whose columns other programs read by name."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("scipy", reason="needs scipy (extra 'sim')")

import osimlite
from osimlite.errors import DoubtfulWarning
from osimlite.io.tables.storage import read_sto
from tests.cli.command import run
from tests.labs import change, copy_lab
from tests.suite import choose


def test_the_moments_without_equilibrium_are_named(tmp_path: Path) -> None:
    """Times without equilibrium are named in the output, in JSON, and in the header of each table with NaN."""
    folder = copy_lab("unbalanced", tmp_path)
    done = run("run", "ma.xml", "-o", "out", folder=folder)
    assert done.code == 0
    assert "17 of 51 times, from 0.62 s to 0.94 s" in " ".join(done.out.split())
    assert (
        "calf"
        in (folder / "out" / "ma_MuscleAnalysis_FiberLength.sto")
        .read_text()
        .partition("endheader")[0]
    )
    assert "NaN" not in (folder / "out" / "ma_MuscleAnalysis_Length.sto").read_text()
    summary = osimlite.run(folder / "ma.xml", folder / "again").summary
    assert len(summary["without_equilibrium"]["/forceset/calf"]) == 17
    json.dumps(summary["without_equilibrium"])


def test_states_of_a_file_without_equilibrium(tmp_path: Path) -> None:
    folder = copy_lab("unbalanced", tmp_path)
    kinematics = '<Kinematics name="K"/><StatesReporter name="S"/></objects>'
    change(folder / "kin.xml", ("</objects>", kinematics))
    states = osimlite.run(folder / "kin.xml", folder / "one").tables["kin_S_states.sto"]
    assert np.isnan(states.rows).any()
    (folder / "states.sto").write_bytes(
        (folder / "one" / "kin_S_states.sto").read_bytes().replace(b"nan", b"0.5")
    )
    change(
        folder / "kin.xml",
        ("<coordinates_file>walk.mot", "<coordinates_file>"),
        ("<states_file>", "<states_file>states.sto"),
    )
    again = osimlite.run(folder / "kin.xml", folder / "two").tables["kin_S_states.sto"]
    assert np.isnan(again.rows).tolist() == np.isnan(states.rows).tolist()


def test_a_muscle_that_never_has_an_equilibrium(tmp_path: Path) -> None:
    folder = copy_lab("unbalanced", tmp_path)
    change(folder / "leg.osim", ("<tendon_slack_length>0.40<", "<tendon_slack_length>0.60<"))
    change(
        folder / "ma.xml",
        ("</objects>", '<ForceReporter name="F"/><JointReaction name="J"/></objects>'),
    )
    tables = osimlite.run(folder / "ma.xml", folder / "out").tables
    assert np.isnan(tables["ma_MuscleAnalysis_FiberLength.sto"].rows).all()
    assert np.isfinite(tables["ma_MuscleAnalysis_MomentArm_knee_angle.sto"].rows).all()
    assert tables["ma_F_forces.sto"].columns == ("calf",)
    loads = tables["ma_J_ReactionLoads.sto"]
    points = [label.endswith(("_px", "_py", "_pz")) for label in loads.columns]
    assert np.isfinite(loads.rows[:, points]).all()
    assert np.isnan(loads.rows[:, ~np.array(points)]).all()


@pytest.mark.parametrize(
    "probe", ["Umberger2010MuscleMetabolicsProbe", "Bhargava2004MuscleMetabolicsProbe"]
)
@pytest.mark.parametrize("start", ["0.2", "0.25", "0"])
def test_given_forces_are_not_doubted(tmp_path: Path, probe: str, start: str) -> None:
    """Probes of muscles cause no warning, nor do forces that cover the analysis but not the time from 0 on."""
    folder = copy_lab("probe", tmp_path)
    text = (folder / "leg.osim").read_text()
    assert "Umberger2010MuscleMetabolicsProbe" in text
    (folder / "leg.osim").write_text(text.replace("Umberger2010MuscleMetabolicsProbe", probe))
    for setup in ("so.xml", "jr.xml"):
        change(folder / setup, ("<initial_time>0.2<", f"<initial_time>{start}<"))
    with warnings.catch_warnings():
        warnings.simplefilter("error", DoubtfulWarning)
        first = osimlite.run(folder / "so.xml")
        result = osimlite.run(folder / "jr.xml")
    assert "probe" not in str(result.messages).lower() + str(first.messages).lower()


def test_given_forces_that_end_early_are_told(tmp_path: Path) -> None:
    folder = copy_lab("probe", tmp_path)
    osimlite.run(folder / "so.xml")
    change(folder / "jr.xml", ("<final_time>0.4<", "<final_time>0.5<"))
    with pytest.warns(
        DoubtfulWarning, match=r"forces of 'so_StaticOptimization_force.sto' .* 0.2 to 0.4 s"
    ):
        osimlite.run(folder / "jr.xml")


@pytest.mark.parametrize("name", ["lim", "pelvis_limit", "PotentialEnergy"])
def test_energy_of_limits_has_one_label(tmp_path: Path, name: str) -> None:
    """StaticOptimization uses the label of ForceReporter and OpenSim, for any name of the force."""
    folder = copy_lab("energy", tmp_path)
    change(folder / "leg.osim", ('name="lim"', f'name="{name}"'))
    forces = osimlite.run(folder / "so.xml", folder / "out").tables[
        "so_StaticOptimization_force.sto"
    ]
    reported = osimlite.run(folder / "fr.xml", folder / "out").tables
    (reporter,) = (table for label, table in reported.items() if label.endswith("_forces.sto"))
    assert "PotentialEnergy" in forces.columns
    assert not any("." in label for label in forces.columns)
    assert forces.columns[: len(reporter.columns)] == reporter.columns
    assert read_sto(folder / "out" / "so_StaticOptimization_force.sto").columns == forces.columns


@pytest.mark.parametrize("setup", ["cmc.xml", "cmc_slow.xml"])
def test_a_lock_is_named(tmp_path: Path, setup: str) -> None:
    """A task of a locked coordinate does not end the motion, and a message names the lock."""
    folder = copy_lab("locked", tmp_path)
    result = osimlite.run(folder / setup, folder / "out")
    assert result.done
    said = dict(result.messages)["pelvis_tx"]
    assert "locked at 0 m" in said
    (errors,) = (table for name, table in result.tables.items() if name.endswith("_pErr.sto"))
    assert (errors["pelvis_tx"] == 0.0).all()


SHORT_MUSCLE = """<Thelen2003Muscle name="short"><max_isometric_force>381</max_isometric_force>
<optimal_fiber_length>0.052</optimal_fiber_length><tendon_slack_length>{slack:.12f}</tendon_slack_length>
<path><GeometryPath name="path"><PathPointSet><objects>
<PathPoint name="a"><socket_parent_frame>/bodyset/pelvis</socket_parent_frame><location>-0.06 -0.02 0</location></PathPoint>
<PathPoint name="b"><socket_parent_frame>/bodyset/thigh</socket_parent_frame><location>-0.03 -0.05 0</location></PathPoint>
</objects></PathPointSet></GeometryPath></path></Thelen2003Muscle></objects></ForceSet>"""


def test_a_window_of_no_length_is_refused(tmp_path: Path) -> None:
    folder = copy_lab("locked", tmp_path)
    change(
        folder / "cmc.xml",
        ("<cmc_time_window>0.01<", "<cmc_time_window>0<"),
    )
    done = run("run", "cmc.xml", "-o", "out", folder=folder)
    assert done.code == 2
    assert "cmc.xml: cmc_time_window is 0 s, expected more than 0" in done.err


def test_files_beside_a_setup_are_named_as_the_setup_is(tmp_path: Path) -> None:
    """Messages name files near the setup without `./`, as the setup is named."""
    folder = copy_lab("ground", tmp_path)
    change(folder / "loads.xml", ("ground_force_v", "ground_forc_v"))
    done = run("run", "id.xml", "-o", "out", folder=folder)
    text = " ".join((done.out + done.err).split())
    assert " loads.xml:" in f" {text}" and "./" not in text


def test_an_unknown_force_to_exclude_does_not_end_a_run(tmp_path: Path) -> None:
    """OpenSim excludes nothing for such a name, and continues."""
    folder = copy_lab("ground", tmp_path)
    rows = osimlite.run(folder / "id_all.xml", folder / "one").tables["id_all.sto"].rows
    change(folder / "id_all.xml", ("</forces_to_exclude>", " nothing</forces_to_exclude>"))
    done = osimlite.run(folder / "id_all.xml", folder / "two")
    assert np.array_equal(done.tables["id_all.sto"].rows, rows)
    assert "no group of forces 'nothing'" in dict(done.messages)["forces to exclude"]


def test_computed_controls_do_not_depend_on_rounding(tmp_path: Path) -> None:
    """Adding the width of an atom to the length of a tendon changes no muscle force.

    Fibers of a short muscle at a small activation are stiff. With the accuracy of OpenSim's
    prediction they do not converge: the first forces change by 0.8 N, those after 0.1 s by 85 N.
    """
    tables = []
    for number in range(choose(2, 3)):
        (tmp_path / str(number)).mkdir()
        folder = copy_lab("locked", tmp_path / str(number))
        muscle = SHORT_MUSCLE.format(slack=0.023 + number * 1e-10)
        change(folder / "leg.osim", ("</objects></ForceSet>", muscle))
        result = osimlite.run(folder / "cmc_free.xml", folder / "out")
        assert result.done
        (table,) = (
            item for name, item in result.tables.items() if name.endswith("_Actuation_force.sto")
        )
        tables.append(table)
    first, *others = tables
    for other in others:
        assert first.columns == other.columns
        assert np.abs(first.rows[0] - other.rows[0]).max() < 0.05


PART = '<LabContactForce name="cartilage">'
UNKNOWN = {
    "a force": [],
    "two forces": [(PART, '<Other_Plugin name="more"><size>1</size></Other_Plugin>' + PART)],
    "a wrap object": [
        (
            '<Body name="thigh">',
            '<Body name="thigh"><WrapObjectSet name="w"><objects><LabWrap name="patella"><size>1</size></LabWrap>'
            "</objects></WrapObjectSet>",
        )
    ],
}


@pytest.mark.parametrize("part", [*UNKNOWN])
@pytest.mark.parametrize("setup", ["scale.xml", "ik.xml"])
def test_parts_of_unknown_classes_are_named(tmp_path: Path, part: str, setup: str) -> None:
    folder = copy_lab("plugin", tmp_path)
    change(folder / "leg.osim", *UNKNOWN[part])
    done = run("run", setup, "-o", "out", folder=folder)
    # Once, in the summary.
    assert (done.code, done.err) == (0, "")
    words = " ".join(done.out.split())
    for name in ("LabContactForce", "LabWrap", "Other_Plugin"):
        assert (name in words) == (name in (folder / "leg.osim").read_text())
    assert ("keep the size of the generic model" in words) == (setup == "scale.xml")


@pytest.mark.parametrize("setup", ["id.xml", "so.xml"])
def test_advice_names_no_option_that_run_lacks(tmp_path: Path, setup: str) -> None:
    done = run("run", setup, folder=copy_lab("plugin", tmp_path))
    # As for several setups: a setup that could not run is no failed search.
    assert done.code == 2
    assert "LabContactForce" in done.err
    assert "skip" not in done.err


@pytest.mark.parametrize("command", ["static-optimization", "inverse-dynamics"])
def test_commands_without_the_option_do_not_advise_it(tmp_path: Path, command: str) -> None:
    done = run(command, "leg.osim", "walk.mot", folder=copy_lab("plugin", tmp_path))
    assert done.code == 1 and "or remove them from the model" in done.err
    assert "skip" not in done.err


@pytest.mark.parametrize("workers", ["1", "2"])
def test_warnings_about_results_stand_in_their_rows(tmp_path: Path, workers: str) -> None:
    """Processes of workers printed them as Python does, with a line of code."""
    folder = copy_lab("plugin", tmp_path)
    setups = ["ik.xml", "scale.xml"]
    done = run("run", *setups, "-o", "out", "--workers", workers, folder=folder)
    assert (done.code, done.err) == (0, "")
    assert " ".join(done.out.split()).count("unknown classes:") == 2


def test_commands_without_setups_name_unknown_classes(tmp_path: Path) -> None:
    folder = copy_lab("plugin", tmp_path)
    scaled = run("scale", "leg.osim", "--factor", "thigh=1.1", "-o", "scaled.osim", folder=folder)
    fitted = run("ik", "leg.osim", "static.trc", "-o", "ik", folder=folder)
    for done in (scaled, fitted):
        assert done.code == 0, done.err
        assert "LabContactForce" in done.err


EMPTY = {
    "a range": ("<time_range>0 0.05</time_range>", "<time_range />"),
    "a number": ("<accuracy>1e-9</accuracy>", "<accuracy></accuracy>"),
    "a switch": ("<report_errors>true</report_errors>", "<report_errors/>"),
    "a word for a number": ("<accuracy>1e-9</accuracy>", "<accuracy>fine</accuracy>"),
    "one time": ("<time_range>0 0.05</time_range>", "<time_range>0</time_range>"),
}


@pytest.mark.parametrize("what", [*EMPTY])
def test_what_opensim_reads_as_a_default_is_run(tmp_path: Path, what: str) -> None:
    folder = copy_lab("unseen", tmp_path)
    change(folder / "ik.xml", EMPTY[what])
    done = run("run", "ik.xml", "-o", "out", folder=folder)
    assert done.code == 0, done.err
    assert "keeps the default" in " ".join((done.out + done.err).split())
    report = osimlite.validate(folder / "ik.xml")
    codes = {finding.code: str(finding.severity) for finding in report.findings}
    if what in ("a range", "a number", "a switch"):
        assert codes["OSIM204"] == "warning"
    else:
        assert codes.get("OSIM201", codes.get("OSIM202")) == "error"


@pytest.mark.parametrize("tag", ["initial_time", "output_precision"])
def test_what_opensim_refuses_is_refused(tmp_path: Path, tag: str) -> None:
    """Empty numbers in setups of older classes have no default."""
    folder = copy_lab("energy", tmp_path)
    text = (folder / "so.xml").read_text()
    text = text.replace("<initial_time>0</initial_time>", "") if tag == "initial_time" else text
    (folder / "so.xml").write_text(
        text.replace('<AnalyzeTool name="so">', f'<AnalyzeTool name="so"><{tag}/>')
    )
    done = run("run", "so.xml", folder=folder)
    assert done.code == 2
    assert "OpenSim rejects the file" in done.err


def test_an_empty_switch_of_an_older_class_is_off(tmp_path: Path) -> None:
    folder = copy_lab("energy", tmp_path)
    change(
        folder / "so.xml",
        ("<use_muscle_physiology>true</use_muscle_physiology>", "<use_muscle_physiology/>"),
    )
    first = osimlite.run(folder / "so.xml", folder / "one").tables[
        "so_StaticOptimization_activation.sto"
    ]
    change(
        folder / "so.xml",
        ("<use_muscle_physiology/>", "<use_muscle_physiology>false</use_muscle_physiology>"),
    )
    second = osimlite.run(folder / "so.xml", folder / "two").tables[
        "so_StaticOptimization_activation.sto"
    ]
    assert (first.rows == second.rows).all()


def test_inverse_dynamics_of_columns_by_paths(tmp_path: Path) -> None:
    """The motion is computed, with a warning that OpenSim would not compute it."""
    folder = copy_lab("paths", tmp_path)
    done = run("run", "id.xml", "-o", "out", folder=folder)
    assert (done.code, done.err) == (0, "")
    assert "OpenSim's inverse dynamics uses the default values" in " ".join(done.out.split())
    with pytest.warns(DoubtfulWarning, match="by paths"):
        by_path = next(iter(osimlite.run(folder / "id.xml", folder / "one").tables.values()))
    text = (folder / "walk.mot").read_text()
    for path in [word for word in text.split() if word.startswith("/jointset/")]:
        text = text.replace(path, path.split("/")[-2])
    (folder / "walk.mot").write_text(text)
    result = osimlite.run(folder / "id.xml", folder / "two")
    assert (next(iter(result.tables.values())).rows == by_path.rows).all()
    assert "columns" not in dict(result.messages)


CHAINED = """<OpenSimDocument Version="40600"><InverseDynamicsTool name="id"><results_directory>.</results_directory>
<model_file>leg.osim</model_file><time_range>0 0.05</time_range><forces_to_exclude>Muscles</forces_to_exclude>
<coordinates_file>{folder}ik.mot</coordinates_file>
<lowpass_cutoff_frequency_for_coordinates>-1</lowpass_cutoff_frequency_for_coordinates>
<output_gen_force_file>id.sto</output_gen_force_file></InverseDynamicsTool></OpenSimDocument>"""


@pytest.mark.parametrize("stale", [False, True])
@pytest.mark.parametrize("folder_name", ["", "results/"])
@pytest.mark.parametrize("workers", ["1", "2"])
def test_results_put_elsewhere_are_found(
    tmp_path: Path, stale: bool, folder_name: str, workers: str
) -> None:
    """A setup reads the result of another one from the folder of -o, even if an old file is in the usual folder."""
    folder = copy_lab("unseen", tmp_path)
    change(
        folder / "ik.xml",
        ("<output_motion_file>ik.mot<", f"<output_motion_file>{folder_name}ik.mot<"),
    )
    (folder / "results").mkdir()
    (folder / "id.xml").write_text(CHAINED.format(folder=folder_name))
    expected = osimlite.run(folder / "ik.xml", tmp_path / "one").tables["ik.mot"]
    if stale:
        old = (tmp_path / "one" / "ik.mot").read_text().splitlines()
        (folder / folder_name / "ik.mot").write_text("\n".join([*old[:-2], ""]))
    done = run("run", "id.xml", "ik.xml", "-o", "out", "--workers", workers, folder=folder)
    assert done.code == 0, done.out + done.err
    moments = read_sto(folder / "out" / "id" / "id.sto")
    assert moments.times.tolist() == pytest.approx(expected.times.tolist())
    assert (folder / folder_name / "ik.mot").exists() == stale


@pytest.mark.parametrize("order", [("jr.xml", "so.xml"), ("so.xml", "jr.xml")])
@pytest.mark.parametrize("where", ["out", ""])
def test_tables_that_a_tool_calls_by_its_name_are_found(
    tmp_path: Path, order: tuple[str, str], where: str
) -> None:
    """The force file of static optimization has no property for its name; its name follows from that of the tool."""
    folder = copy_lab("probe", tmp_path)
    done = run("run", *order, *(("-o", where) if where else ()), folder=folder)
    assert done.code == 0, done.out + done.err
    alone = copy_lab("probe", tmp_path / "alone")
    for setup in ("so.xml", "jr.xml"):
        osimlite.run(alone / setup)
    name = next(alone.glob("jr_*ReactionLoads.sto")).name
    mine = read_sto(folder / where / "jr" / name if where else folder / name)
    assert (mine.rows == read_sto(alone / name).rows).all()


def test_a_table_that_no_tool_of_the_run_writes_waits_for_none(tmp_path: Path) -> None:
    """A file whose name only begins like that of a tool is not a result of this tool."""
    folder = copy_lab("unseen", tmp_path)
    osimlite.run(folder / "ik.xml")
    (folder / "ik_measured.mot").write_bytes((folder / "ik.mot").read_bytes())
    (folder / "id.xml").write_text(
        CHAINED.format(folder="").replace(">ik.mot<", ">ik_measured.mot<")
    )
    (folder / "walk.trc").unlink()
    done = run("run", "ik.xml", "id.xml", folder=folder)
    assert "1 done, 1 failed" in " ".join(done.out.split())


@pytest.mark.parametrize("setup", ["kin.xml", "so.xml"])
def test_paths_without_a_quantity_are_told_as_opensim_reads_them(
    tmp_path: Path, setup: str
) -> None:
    """OpenSim's analyses accept names and paths of values; with other paths every coordinate is 0."""
    folder = copy_lab("loop", tmp_path)
    change(folder / "walk.mot", ("time\tja_q\tjb_q", "time\t/jointset/ja/ja_q\t/jointset/jb/jb_q"))
    result = osimlite.run(folder / setup)
    (said,) = [item.message for item in result.warnings if item.code == "OSIM842"]
    assert "OpenSim looks for names or for paths that end with '/value', and uses 0" in said


@pytest.mark.parametrize(
    ("setup", "consequence"),
    [("so.xml", "its results are not affected"), ("ma.xml", "are NaN at these times")],
)
def test_the_consequence_of_a_missing_equilibrium_is_that_of_the_analysis(
    tmp_path: Path, setup: str, consequence: str
) -> None:
    folder = copy_lab("unbalanced", tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DoubtfulWarning)
        result = osimlite.run(folder / setup)
    messages = [message for name, message in result.messages if name == "no equilibrium"]
    assert messages and all(consequence in message for message in messages)
