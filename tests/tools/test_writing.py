"""Tests of writing results: completely or not at all, and never over the inputs."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path

import pytest

import osimlite
from osimlite.errors import OsimliteError
from osimlite.tools.many import JOURNAL
from tests.cli.command import run
from tests.tools.support import laid_out, state


@pytest.fixture
def trial(tmp_path: Path) -> Path:
    """Return the folder of a trial with setups of several tools; its model is in the parent folder."""
    return laid_out(tmp_path)


def change(setup: Path, old: str, new: str) -> Path:
    text = setup.read_text()
    assert old in text
    setup.write_text(text.replace(old, new))
    return setup


@pytest.mark.parametrize(
    ("setup", "result", "into"),
    [
        ("z_ik.xml", ">ik.mot<", ">trial.trc<"),
        ("z_ik.xml", ">ik.mot<", ">../model.osim<"),
        ("z_ik.xml", ">ik.mot<", ">../trial/z_ik.xml<"),
        ("z_ik.xml", ">ik.mot<", ">link.mot<"),
        ("z_ik.xml", ">ik.mot<", ">twin.mot<"),
        ("id.xml", ">id.sto<", ">ik.mot<"),
        ("forward.xml", ">moved<", ">.<"),
        ("scale.xml", ">scaled.osim<", ">trial.trc<"),
    ],
)
def test_no_result_replaces_an_input(trial: Path, setup: str, result: str, into: str) -> None:
    (trial / "fw_states.sto").write_bytes((trial / "states.sto").read_bytes())
    (trial / "link.mot").symlink_to("trial.trc")
    os.link(trial / "trial.trc", trial / "twin.mot")
    change(trial / "forward.xml", ">states.sto<", ">fw_states.sto<")
    change(trial / setup, result, into)
    before = state(trial.parent)
    with pytest.raises(
        OsimliteError, match=rf"{setup}: a result would replace .*, an input of this setup"
    ):
        osimlite.run(trial / setup)
    assert state(trial.parent) == before


def test_a_model_may_take_its_own_place(trial: Path) -> None:
    """The public setup of Rajagopal2016 places its markers in this way."""
    change(trial / "scale.xml", ">placed.osim<", ">../model.osim<")
    before = (trial.parent / "model.osim").read_bytes()
    osimlite.run(trial / "scale.xml")
    assert (trial.parent / "model.osim").read_bytes() != before


def test_no_report_replaces_an_input(trial: Path) -> None:
    before = state(trial.parent)
    for name in ("trial.trc", "z_ik.xml", "../model.osim"):
        done = run("run", "z_ik.xml", "--report", name, folder=trial)
        assert done.code == 2 and f"--report would replace '{name}'" in done.err
    assert state(trial.parent) == before


def test_of_several_results_all_are_written_or_none(trial: Path) -> None:
    (trial / "analyzed" / "an_K_dudt.sto").mkdir(parents=True)
    before = state(trial)
    with pytest.raises(
        OsimliteError, match=r"an_K_dudt\.sto: cannot write the file: this is a folder"
    ):
        osimlite.run(trial / "analyze.xml")
    assert state(trial) == before


def test_an_error_of_a_tool_names_its_setup(trial: Path) -> None:
    change(trial / "analyze.xml", "_coordinates>6<", "_coordinates>0<")
    with pytest.raises(
        OsimliteError, match=r"analyze\.xml: a low-pass frequency must be a positive number"
    ):
        osimlite.run(trial / "analyze.xml")


@pytest.mark.parametrize(
    "noted",
    [
        b"\xff\xfe{}\n",
        b'[]\nnull\n{"setup": [], "status": "done"}\n{"setup": "id.xml", "status": "done", "files": 3}\n',
    ],
)
def test_a_note_that_is_damaged_is_no_note(trial: Path, noted: bytes) -> None:
    (trial / JOURNAL).write_bytes(noted)
    done = run("run", "z_ik.xml", "id.xml", "--resume", folder=trial)
    assert (done.code, done.err) == (0, "") and done.out.endswith("2 setups: 2 done\n")
    assert not (trial / JOURNAL).exists()


def test_what_cannot_be_noted_is_done_all_the_same(trial: Path) -> None:
    (trial / JOURNAL).mkdir()
    change(trial / "id.xml", ">id.sto<", ">ik.mot<")
    done = run("run", "z_ik.xml", "id.xml", folder=trial)
    assert done.code == 2 and done.out.endswith("2 setups: 1 done, 1 failed\n")


@pytest.mark.parametrize("place", ["name", "results_directory", "coordinates_file", "model_file"])
def test_names_that_are_too_long_are_told(trial: Path, place: str) -> None:
    text, long = (trial / "analyze.xml").read_text(), 260 * "x"
    new = re.sub(f'{place}="an"', f'{place}="{long}"', text)
    new = re.sub(f"<{place}>.*?<", f"<{place}>{long}<", new) if new == text else new
    (trial / "analyze.xml").write_text(new)
    for check in (True, False):
        with pytest.raises(OsimliteError, match=r"File name too long|no such file|does not exist"):
            osimlite.run(trial / "analyze.xml", check=check)


@pytest.mark.parametrize("workers", [1, 2])
def test_nothing_is_computed_from_what_an_earlier_run_has_left(trial: Path, workers: int) -> None:
    """With -o, the motion goes to another folder, and the forces are computed from it, not from an old motion."""
    done = run(
        "run", "id.xml", "z_ik.xml", "-o", "new", "--workers", workers, "--json", folder=trial
    )
    result = {item["setup"]: item["status"] for item in json.loads(done.out)}
    assert (done.code, result) == (0, {"z_ik.xml": "done", "id.xml": "done"})
    assert (trial / "new" / "id").is_dir() and (trial / "new" / "z_ik" / "ik.mot").is_file()


@pytest.mark.parametrize(
    ("precision", "time"), [(-3, "       0"), (0, "       0"), (12, "      0.200000000000")]
)
def test_digits_behind_the_point(trial: Path, precision: int, time: str) -> None:
    """The numbers of digits are those of OpenSim 4.6."""
    change(
        trial / "forward.xml",
        "<initial_time>",
        f"<output_precision>{precision}</output_precision><initial_time>",
    )
    osimlite.run(trial / "forward.xml")
    rows = (trial / "moved" / "fw_states.sto").read_text().partition("endheader\n")[2].splitlines()
    assert rows[1].split("\t")[0] == time


def test_more_digits_than_there_are(trial: Path) -> None:
    change(
        trial / "forward.xml",
        "<initial_time>",
        "<output_precision>3000000000</output_precision><initial_time>",
    )
    with pytest.raises(OsimliteError, match="output_precision"):
        osimlite.run(trial / "forward.xml")


def test_markers_without_weights_are_not_told_to_be_unseen(trial: Path) -> None:
    """In OpenSim, the weight of a task is 0 unless it is set."""
    told = osimlite.run(trial / "scale.xml").messages
    words = "1 frame without a measurement of positive weight: these frames get the pose of the frame before"
    assert ("markers", words) in [tuple(fact) for fact in told]
