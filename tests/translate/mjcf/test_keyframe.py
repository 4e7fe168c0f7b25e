"""Tests of the keyframe from which simulations of MJCF files must start."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

import osimlite
from osimlite.models.jumper import jumper
from tests.cli.command import run


def test_gait2392_runs_from_its_keyframe(shared: Path) -> None:
    path = shared / "corpus" / "models" / "m0014" / "gait2392_thelen2003muscle.osim"
    mjcf = osimlite.to_mjcf(osimlite.read(path), visuals=False)
    assert (
        "the keyframe 'default'" in mjcf.start_note
        and "<!-- Start simulations from the keyframe" in mjcf.text
    )
    model = mujoco.MjModel.from_xml_string(mjcf.text, mjcf.files)
    errors = []
    for start in (
        mujoco.mj_resetData,
        lambda model, data: mujoco.mj_resetDataKeyframe(model, data, 0),
    ):
        data = mujoco.MjData(model)
        start(model, data)
        mujoco.mj_forward(model, data)
        errors.append(
            np.abs(data.efc_pos[data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY]).max()
        )
    # The numbers in the note on qpos0 and on the keyframe are right.
    assert errors[0] > 0.01 and errors[1] < 1e-4
    while data.time < 0.5:
        mujoco.mj_step(model, data)
    assert (
        np.isfinite(data.qpos).all() and not data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number
    )


def test_the_command_says_where_to_start(fixtures: Path, tmp_path: Path) -> None:
    model = str(fixtures / "lint" / "OSIM602" / "pass-example.osim")
    done = run("translate", model, "--to", "mjcf", "-o", "out", folder=tmp_path)
    assert done.code == 0 and "start simulations from the keyframe 'default'" in done.out
    assert "qpos0" in (tmp_path / "out" / "pass-example.xml").read_text(encoding="utf-8")


def test_a_model_without_equalities_starts_anywhere() -> None:
    mjcf = osimlite.to_mjcf(jumper(), visuals=False)
    assert mjcf.start_note == "" and "qpos0" not in mjcf.text
