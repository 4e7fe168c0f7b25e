"""Results are written all or not at all, and never over what they come from."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

pytest.importorskip("numba", reason="needs numba (extra 'sim')")

import osimlite
from osimlite.errors import OsimliteError
from tests.cli.command import run
from tests.tools.test_damaged import laid_out, state


@pytest.fixture
def trial(tmp_path: Path) -> Path:
    """The folder of a trial with setups of several tools; its model is in the folder above."""
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
    with pytest.raises(OsimliteError, match=rf"{setup}: a result would replace .*, which it is computed from"):
        osimlite.run(trial / setup)
    assert state(trial.parent) == before


def test_a_model_may_take_its_own_place(trial: Path) -> None:
    """As the public setup of Rajagopal2016 places its markers."""
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
    with pytest.raises(OsimliteError, match=r"an_K_dudt\.sto: cannot write the file: this is a folder"):
        osimlite.run(trial / "analyze.xml")
    assert state(trial) == before


def test_an_error_of_a_tool_names_its_setup(trial: Path) -> None:
    change(trial / "analyze.xml", "_coordinates>6<", "_coordinates>0<")
    with pytest.raises(OsimliteError, match=r"analyze\.xml: a low-pass frequency is a positive number"):
        osimlite.run(trial / "analyze.xml")
