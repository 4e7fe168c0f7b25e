"""Tests of bodies, joints and inertias of MJCF files in OpenSim."""

from __future__ import annotations

import json

import numpy as np
import pytest

import osimlite
from osimlite.errors import OsimliteError

mujoco = pytest.importorskip("mujoco", reason="needs mujoco (extra 'mujoco')")

from tests.translate.mjcf_import import comparison, models  # noqa: E402


@pytest.fixture(scope="module")
def mechanism(tmp_path_factory):
    return models.write_mjcf(tmp_path_factory.mktemp("mjcf"), models.MECHANISM)


@pytest.mark.parametrize("armature", ["rotors", "none"])
def test_bodies_move_as_in_mujoco(mechanism, armature):
    made = osimlite.from_mjcf(mechanism, armature=armature)
    assert comparison.pose_errors(mechanism, made, 30) < 1e-12
    assert comparison.mass_errors(mechanism, made, 10) < 1e-12
    # Rotors have no mass, but the inertia of the armature.
    assert not list(osimlite.validate(made.model))


def test_y_up_turns_everything(mechanism):
    upright = osimlite.from_mjcf(mechanism, up="y")
    made = osimlite.from_mjcf(mechanism)
    turn = np.array(((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)))
    poses = [
        osimlite.mechanism(item.model).body_transforms({"lift": 0.4}) for item in (upright, made)
    ]
    for name in poses[0]:
        assert np.allclose(poses[0][name][:3, 3], turn @ poses[1][name][:3, 3], atol=1e-12)
    assert np.allclose(upright.model.gravity, turn @ made.model.gravity)


def test_the_keyframe_is_the_default_pose(mechanism):
    made = osimlite.from_mjcf(mechanism, keyframe="high")
    assert made.model["/jointset/trunk_joint/root_tz"].default_value == 2.0
    assert "lift\tturn" in made.files["model_keyframes.mot"]
    for name, hint in (("low", "; it has high"), ("hig", r"; did you mean 'high'\?")):
        with pytest.raises(OsimliteError, match=f"^the file has no keyframe '{name}'{hint}$"):
            osimlite.from_mjcf(mechanism, keyframe=name)


def test_springs_and_dampers_are_exact(mechanism):
    made = osimlite.from_mjcf(mechanism)
    spring = made.model["/forceset/turn_spring"]
    assert (spring.stiffness, spring.rest_length, spring.viscosity) == (5.0, 0.2, 0.7)
    assert made.model["/forceset/lift_spring"].viscosity == 0.3


def test_every_object_is_accounted_for(mechanism, tmp_path):
    made = osimlite.from_mjcf(mechanism)
    account = made.fidelity
    model = mujoco.MjModel.from_xml_path(str(mechanism))
    known = account.translated.keys() | {record.component for record in account}
    for kind, count in (
        ("body", model.nbody),
        ("joint", model.njnt),
        ("geom", model.ngeom),
        ("site", model.nsite),
        ("sensor", model.nsensor),
        ("key", model.nkey),
    ):
        number = getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}")
        for index in range(count):
            name = mujoco.mj_id2name(model, number, index) or f"{kind}_{index}"
            assert f"/{kind}/{name}" in known
    lost = {record.component: record.detail for record in account if record.how == "dropped"}
    assert lost["/joint/slip"] == "frictionloss 0.1"
    files = made.write(tmp_path / "out")
    assert json.loads((tmp_path / "out" / "fidelity.json").read_text())["target"] == "osim"
    assert osimlite.read(files[0]).name == "mechanism"


def test_constraints(tmp_path):
    path = models.write_mjcf(tmp_path, models.LOOPS)
    made = osimlite.from_mjcf(path)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    constraints = {item.name: item for item in made.model.constraint_set.objects}
    assert made.model["/jointset/c_joint/jc"].locked
    assert made.model["/jointset/c_joint/jc"].default_value == 0.25
    assert not constraints["connect"].isEnforced
    mechanism = osimlite.mechanism(made.model)
    for qpos in comparison.random_qpos(model, 10):
        data.qpos[:] = qpos
        mujoco.mj_forward(model, data)
        values = made.coordinates.values(qpos)
        coupler = constraints["couple"].coupled_coordinates_function
        off = values["jb"] - np.polyval(coupler.coefficients, values["ja"])
        rows = [k for k in range(data.nefc) if data.efc_id[k] == 0]
        assert abs(off - data.efc_pos[rows[0]]) < 1e-12
        # The first three rows of MuJoCo's weld are the distance of the anchors.
        weld = next(item for item in made.model.constraint_set.objects if item.name == "weld")
        poses = mechanism.body_transforms(values)
        first, second = weld.frames
        ends = []
        for frame, body in ((first, "c"), (second, "d")):
            ends.append(poses[body] @ np.array((*frame.translation, 1.0)))
        rows = [k for k in range(data.nefc) if data.efc_id[k] == 2][:3]
        assert np.allclose(ends[0][:3] - ends[1][:3], data.efc_pos[rows], atol=1e-12)


def test_wrong_words_and_files_are_refused(mechanism, tmp_path):
    with pytest.raises(OsimliteError, match=r"^armature must be 'rotors' or 'none', not 'x'"):
        osimlite.from_mjcf(mechanism, armature="x")
    with pytest.raises(OsimliteError, match="the file does not exist"):
        osimlite.from_mjcf(tmp_path / "absent.xml")
    broken = models.write_mjcf(tmp_path, models.MECHANISM.replace("slide", "glide", 1), "b.xml")
    with pytest.raises(OsimliteError, match=r"b.xml:\d+: MuJoCo rejects the file: .*glide"):
        osimlite.from_mjcf(broken)
    part = models.write_mjcf(tmp_path, "<mujocoinclude/>", "part.xml")
    with pytest.raises(OsimliteError, match="convert the file that includes it"):
        osimlite.from_mjcf(part)
    # An element of an included file has no line here: no position must appear in the message.
    (tmp_path / "bad.stl").write_bytes(b"solid")
    mesh = '<mujocoinclude><asset><mesh file="bad.stl"/></asset></mujocoinclude>'
    models.write_mjcf(tmp_path, mesh, "mesh.xml")
    main = models.write_mjcf(tmp_path, '<mujoco><include file="mesh.xml"/></mujoco>', "main.xml")
    with pytest.raises(OsimliteError, match=r"main.xml: MuJoCo rejects .*'bad', id 0$"):
        osimlite.from_mjcf(main)
    empty = models.write_mjcf(tmp_path, "<mujoco/>", "empty.xml")
    with pytest.raises(OsimliteError, match="no bodies"):
        osimlite.from_mjcf(empty)


@pytest.mark.oracle
def test_bodies_move_the_same_in_opensim(mechanism, tmp_path):
    pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
    made = osimlite.from_mjcf(mechanism)
    live = comparison.LiveModel(made, tmp_path)
    model = mujoco.MjModel.from_xml_path(str(mechanism))
    data = mujoco.MjData(model)
    for qpos in comparison.random_qpos(model, 10):
        data.qpos[:] = qpos
        mujoco.mj_forward(model, data)
        live.place(made.coordinates.values(qpos))
        for body, name in comparison.body_names(model, made):
            position, rotation = live.body(name)
            assert np.abs(position - data.xpos[body]).max() < 1e-9
            assert np.abs(rotation - data.xmat[body].reshape(3, 3)).max() < 1e-9


AWAKE = """<mujoco>
  <option><flag sleep="enable"/></option>
  <worldbody>
    <body name="lower" sleep="init"><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body>
    <body name="upper" pos="0 0 0.15"><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body>
  </worldbody>
</mujoco>
"""
"""Model with a sleeping body next to an awake one, about which MuJoCo warns when it poses the model."""


@pytest.mark.skipif(
    int(mujoco.__version__.split(".")[0]) < 4, reason="needs a MuJoCo whose bodies can sleep"
)
def test_warnings_after_compilation_are_recorded_and_write_no_file(tmp_path, monkeypatch):
    path = models.write_mjcf(tmp_path, AWAKE)
    (tmp_path / "current").mkdir()
    monkeypatch.chdir(tmp_path / "current")
    made = osimlite.from_mjcf(path)
    assert not list((tmp_path / "current").iterdir())
    records = [record for record in made.fidelity if record.kind == "warning"]
    assert len(records) == 1 and "could not be slept" in records[0].detail
