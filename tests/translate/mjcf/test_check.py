"""Tests of `check_mjcf` on a translation of osimlite, and on files with known faults."""

from __future__ import annotations

import json

import numpy as np
import pytest

import osimlite
from osimlite.errors import ModelError, OsimliteError
from osimlite.translate import to_mjcf
from osimlite.translate.mjcf.check import check_mjcf
from osimlite.translate.mjcf.warnings import collect_warnings


@pytest.fixture(scope="module")
def model(corpus):
    return osimlite.read(next(item.path for item in corpus if item.id == "m0005"))


@pytest.fixture(scope="module")
def text(model):
    return to_mjcf(model, visuals=False).text


def checked(model, text, tmp_path):
    file = tmp_path / "file.xml"
    file.write_text(text)
    return check_mjcf(model, file, poses=20)


def test_our_own(model, text, tmp_path):
    check = checked(model, text, tmp_path)
    assert len(check.muscles) == 18 and not check.missing and not check.coordinates
    assert check.bodies.max < 3e-4
    for muscle in check.muscles:
        assert muscle.length.rms < 2e-4 and muscle.worst_arm.rms < 1.5e-3, muscle.name
        assert muscle.fiber == pytest.approx(1.0, abs=1e-12) and muscle.tendon == pytest.approx(
            0.0, abs=1e-12
        )
        assert muscle.force.rms < 0.15
    assert {"hip_flexion_r", "knee_angle_r"} == check.muscles[0].arms.keys()
    assert json.loads(check.to_json())["muscles"][0]["length"]["unit"] == "m"


def test_what_is_wrong_is_found(model, text, tmp_path):
    soleus = model["/forceset/soleus_r"]
    start = text.index('lengthrange="', text.index('<general name="soleus_r"'))
    end = text.index('"', start + 13)
    low, high = map(float, text[start + 13 : end].split())
    wrong = text[: start + 13] + f"{low + 0.01} {high + 0.02}" + text[end:]
    wrong = wrong.replace('joint name="ankle_angle_r"', 'joint name="foot"').replace(
        'joint1="ankle_angle_r"', 'joint1="foot"'
    )
    check = checked(model, wrong, tmp_path)
    result = {muscle.name: muscle for muscle in check.muscles}
    assert check.coordinates == ("ankle_angle_r",)
    assert result["soleus_r"].fiber == pytest.approx(1.0 + 0.01 / (high - low))
    assert result["soleus_r"].tendon == pytest.approx(0.01)
    assert soleus.tendon_slack_length == pytest.approx(low)
    assert result["soleus_r"].length.rms > 1e-3 and result["soleus_l"].length.max < 1e-4


def test_files_that_cannot_be_compared(model, tmp_path):
    with pytest.raises(ModelError, match="has no muscles or other paths"):
        checked(osimlite.Model(name="bare"), "<mujoco/>", tmp_path)
    with pytest.raises(
        ModelError, match="no tendon or actuator with the name of a muscle of the model, such as"
    ):
        checked(model, "<mujoco/>", tmp_path)
    with pytest.raises(OsimliteError, match="MuJoCo does not load it"):
        checked(model, "<mujoco><joint/></mujoco>", tmp_path)


def test_warnings_of_mujoco_leave_no_file(tmp_path, monkeypatch):
    mujoco = pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)
    with collect_warnings(mujoco) as texts:
        data = mujoco.MjData(model := mujoco.MjModel.from_xml_string(UNSTABLE))
        data.qvel[:] = np.nan
        mujoco.mj_step(model, data)
    assert texts and not list(tmp_path.iterdir())


UNSTABLE = "<mujoco><worldbody><body><freejoint/><geom size='.1'/></body></worldbody></mujoco>"
