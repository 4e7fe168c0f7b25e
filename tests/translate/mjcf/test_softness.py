"""Tests of the errors of MuJoCo's soft constraints on joints and points, as stated in docs/mujoco.md."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

import osimlite


def test_a_falling_leg_keeps_its_knees_and_helpers(shared: Path) -> None:
    mjcf = osimlite.to_mjcf(
        osimlite.read(shared / "corpus" / "models" / "m0005" / "gait10dof18musc.osim")
    )
    model = mujoco.MjModel.from_xml_string(mjcf.text, mjcf.files)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    knee = [model.joint(f"knee_angle_{side}_{axis}").id for side in "rl" for axis in ("tx", "ty")]
    worst = {"knee": 0.0, "all": 0.0}
    for _ in range(500):
        mujoco.mj_step(model, data)
        equal = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
        errors, joints = np.abs(data.efc_pos[equal]), model.eq_obj1id[data.efc_id[equal]]
        worst["knee"] = max(worst["knee"], errors[np.isin(joints, knee)].max())
        worst["all"] = max(worst["all"], errors.max())
    assert 1e-7 < worst["knee"] < 2e-5 and worst["all"] < 1e-4
