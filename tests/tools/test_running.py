"""Tests of running setups of tools: errors, search for files, and folders of results."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("scipy", reason="needs scipy (extra 'sim')")

import numpy as np

import osimlite
from osimlite.errors import DeprecatedWarning, OsimliteError
from osimlite.io.document import cache, survey
from osimlite.io.tables.storage import read_sto, write_sto
from osimlite.tools import running
from osimlite.tools.job import NotRunnable
from osimlite.tools.outcome import Outcome
from osimlite.tools.running import FaultySetup
from tests.cli.command import run

SETUP = """<?xml version="1.0" encoding="UTF-8" ?>
<OpenSimDocument Version="40600">
    <InverseDynamicsTool name="id">
        <results_directory>results</results_directory>
        <model_file>walker.osim</model_file>
        <time_range>0.02 0.1</time_range>
        <coordinates_file>walk.mot</coordinates_file>
        <output_gen_force_file>forces.sto</output_gen_force_file>
    </InverseDynamicsTool>
</OpenSimDocument>
"""


@pytest.fixture
def setup(fixtures: Path, tmp_path: Path) -> Path:
    """Write the setup of a tool that can be run, with its model and its motion."""
    (tmp_path / "walker.osim").write_bytes(
        (fixtures / "walker" / "DynamicWalkerModel.osim").read_bytes()
    )
    times = [0.01 * k for k in range(20)]
    write_sto(
        tmp_path / "walk.mot",
        "walk",
        times,
        ("Pelvis_tx", "RKnee_rz"),
        [[t, 9 * t * t] for t in times],
    )
    (tmp_path / "setup.xml").write_text(SETUP)
    return tmp_path / "setup.xml"


def test_what_is_written_and_what_is_returned(setup: Path) -> None:
    outcome = osimlite.run(setup)
    (file,) = outcome.files
    assert file == setup.parent / "results" / "forces.sto" and outcome.done
    written, table = read_sto(file), outcome.tables["forces.sto"]
    assert written.columns == table.columns
    assert written.times.tolist() == pytest.approx([0.01 * k for k in range(2, 11)])
    assert np.abs(written.rows - table.rows).max() <= 0.5e-8
    lines = file.read_text().splitlines()
    assert lines[:6] == [
        "Inverse Dynamics Generalized Forces", "version=1", "nRows=9", f"nColumns={len(table.columns) + 1}",
        "inDegrees=no", "endheader",
    ]  # fmt: skip
    assert lines[7].startswith("      0.02000000\t")


def test_a_file_of_the_current_folder_is_told(setup: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A trial without data must not silently use the data of another trial."""
    trial = setup.parent / "trial"
    trial.mkdir()
    for name in ("setup.xml", "walker.osim"):
        (trial / name).write_bytes((setup.parent / name).read_bytes())
    monkeypatch.chdir(setup.parent)
    assert (
        "current folder",
        "these files were read in the current folder, because the folder of the setup does not contain them: walk.mot",
    ) in osimlite.run("trial/setup.xml").messages
    done = run("run", "trial/setup.xml", "setup.xml", "-o", "out", folder=setup.parent)
    assert done.out.count("current folder: these files were read in") == 1


def test_the_setup_that_makes_what_is_missing_is_told(setup: Path) -> None:
    """The message names the setup that creates the missing file: inverse kinematics before inverse dynamics."""
    (setup.parent / "walk.mot").unlink()
    fit = osimlite.InverseKinematicsTool(
        name="ik", model_file="walker.osim", output_motion_file="walk.mot"
    )
    osimlite.write(fit, setup.with_name("fit.xml"))
    done = run("run", "setup.xml", folder=setup.parent)
    assert (
        done.code == 2
        and "walk.mot: cannot read the file: no such file; run 'fit.xml' first, which" in done.err
    )


def test_the_command_runs_from_anywhere_and_writes_where_it_is_told(
    setup: Path, tmp_path: Path
) -> None:
    away = tmp_path / "away"
    away.mkdir()
    for word in ("run", "run-tool"):
        done = run(word, "../setup.xml", "-o", word, folder=away)
        assert (done.code, done.err) == (0, "") and f"{word}/forces.sto" in done.out
        assert "check ../setup.xml:7:27: warning OSIM842 'walk.mot' has no column" in " ".join(
            done.out.split()
        )
        assert [path.name for path in (away / word).iterdir()] == ["forces.sto"]
    assert not (tmp_path / "results").exists()


def test_a_misspelt_name_is_told_with_its_line_and_nothing_is_written(setup: Path) -> None:
    setup.write_text(SETUP.replace("walk.mot", "wlak.mot"))
    with pytest.raises(FaultySetup, match=r"setup\.xml:7:.*'wlak\.mot'.* does not exist") as caught:
        osimlite.run(setup)
    assert caught.value.report.errors
    done = run("run", "setup.xml", folder=setup.parent)
    assert done.code == 2 and done.err.count("setup.xml:7:") == 1 and "OSIM821" in done.err
    assert "osimlite: setup.xml: did not run because of this error" in done.err
    assert not (setup.parent / "results").exists()


def test_an_impossible_model_names_the_command_that_checks_it(setup: Path) -> None:
    model = setup.parent / "walker.osim"
    text = model.read_text()
    model.write_text(text.replace("<mass>", "<mas>", 1).replace("</mass>", "</mas>", 1))
    done = run("run", "setup.xml", folder=setup.parent)
    assert done.code == 2 and "has mass nan" in done.err
    assert "'osimlite validate walker.osim' checks the model" in done.err


def test_what_a_setup_names_is_checked_too(setup: Path) -> None:
    motion = setup.parent / "walk.mot"
    motion.write_text(motion.read_text().replace("\n0.05\t", "\n0.04\t"))
    with pytest.raises(OsimliteError, match=r"walk\.mot"):
        osimlite.run(setup)
    with pytest.raises(OsimliteError, match="sort the rows"):
        osimlite.run(setup, check=False)


def test_only_files_are_run(setup: Path) -> None:
    """A list, an object or a folder is refused; for a folder, the message shows how to name its setups."""
    for wrong in ([setup], osimlite.read_document(setup)):
        with pytest.raises(
            OsimliteError,
            match=rf"expected the path of a setup file, found an? {type(wrong).__name__}",
        ):
            osimlite.run(wrong)  # type: ignore[arg-type]
    done = run("run", ".", folder=setup.parent)
    assert (
        done.code == 2
        and ".: expected a setup, found a folder; name the setups in it, for example './*.xml'"
        in done.err
    )


@pytest.mark.parametrize("tag", ["IKTaskSet", "Model"])
def test_what_cannot_be_run_is_refused_by_name(setup: Path, tag: str) -> None:
    setup.write_text(f'<OpenSimDocument Version="40600"><{tag} name="it"/></OpenSimDocument>')
    with pytest.raises(
        NotRunnable, match=f"osimlite cannot run an? {tag}; it runs .*InverseDynamicsTool"
    ):
        osimlite.run(setup)
    assert run("run", "setup.xml", folder=setup.parent).code == 2


def test_an_analysis_that_cannot_be_computed_is_refused_before_anything_is_written(
    setup: Path,
) -> None:
    analyses = "<AnalysisSet><objects><Kinematics name='K'/><InducedAccelerations name='IA'/></objects></AnalysisSet>"
    text = SETUP.replace("InverseDynamicsTool", "AnalyzeTool")
    setup.write_text(text.replace("</coordinates_file>", f"</coordinates_file>{analyses}"))
    with pytest.raises(NotRunnable, match="'IA' is an InducedAccelerations"):
        osimlite.run(setup, check=False)
    assert not (setup.parent / "results").exists()


def test_times_and_files_that_mean_nothing(setup: Path) -> None:
    for old, new, said in (
        ("0.02 0.1", "0.1 0.02", "the first time, 0.1 s, is after the last"),
        ("walker.osim", "", "the setup names no model_file"),
    ):
        setup.write_text(SETUP.replace(old, new))
        with pytest.raises(OsimliteError, match=said):
            osimlite.run(setup, check=False)


def test_a_study_with_a_property_that_nothing_knows_is_not_searched_for(repo, tmp_path):
    for name in ("slide.osim", "slide_guess.sto", "slide_states.sto"):
        (tmp_path / name).write_bytes((repo / "fixtures/setups" / name).read_bytes())
    text = (
        (repo / "fixtures/setups/slide.omoco")
        .read_text()
        .replace("<bounds>0 5</bounds>", "<bound>0 5</bound>")
    )
    (tmp_path / "slide.omoco").write_text(text)
    with pytest.raises(FaultySetup, match=r"slide\.omoco:13:.*has no property <bound>"):
        osimlite.run(tmp_path / "slide.omoco")


def test_the_former_name_of_messages_warns() -> None:
    outcome = Outcome(messages=[("thigh", "was scaled")])
    with pytest.warns(DeprecatedWarning, match="use messages"):
        assert outcome.told == [("thigh", "was scaled")]


def test_the_check_reads_each_document_once(
    setup: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    loads = tmp_path / "loads.xml"
    loads.write_text(
        '<OpenSimDocument Version="40600"><ExternalLoads name="loads"><objects />'
        "<datafile>walk.mot</datafile></ExternalLoads></OpenSimDocument>"
    )
    setup.write_text(
        SETUP.replace(
            "</InverseDynamicsTool>",
            "<external_loads_file>loads.xml</external_loads_file></InverseDynamicsTool>",
        )
    )
    files: list[str] = []

    for module in (cache, survey):
        monkeypatch.setattr(
            module, "read_document", partial(read_counted, files, module.read_document)
        )
    reports = list(running.check_documents(str(setup), {}))
    assert len(reports) == 3
    assert sorted(files) == ["loads.xml", "setup.xml", "walker.osim"]
    # Each reader of a cached document gets a copy, which it may change.
    first, second = (cache.read_object(loads, osimlite.ExternalLoads) for _ in range(2))
    assert first == second
    assert first is not second
    assert sorted(files) == ["loads.xml", "setup.xml", "walker.osim"]


def read_counted(files: list[str], read: Any, source: Any, **options: Any) -> Any:
    """Append the name of a file to `files`, and read it."""
    files.append(Path(source.file).name)
    return read(source, **options)
