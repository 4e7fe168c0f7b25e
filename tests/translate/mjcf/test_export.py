"""Tests of complete MJCF exports: files, names, records, and both versions of MuJoCo."""

from __future__ import annotations

import json
import subprocess
import sys

import mujoco
import numpy as np
import pytest

import osimlite
from osimlite import Body, Coordinate, Marker, Model, PinJoint, SliderJoint
from osimlite.errors import OsimliteError
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.geometry import Mesh
from osimlite.schema.geometry_types import Brick, Cylinder, Sphere
from osimlite.translate import to_mjcf
from osimlite.translate.mjcf.export import Mjcf
from tests.translate.mjcf.compiled import Compiled
from tests.translate.mjcf.conftest import OLDER
from tests.translate.support import unaccounted

# Script that prints the poses of all bodies of each file at its keyframe.
READER = """
import json, sys, mujoco
for path in sys.argv[1:]:
    model = mujoco.MjModel.from_xml_path(path)
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    print(json.dumps([mujoco.__version__, data.xpos.tolist()]))
"""


@pytest.mark.full
def test_both_versions_of_mujoco_have_the_same_bodies(older, corpus, tmp_path):
    chosen = [item for item in corpus if item.id in ("m0113", "m0163", "m0168", "m0187", "m0466")]
    files = []
    for item in chosen:
        mjcf = to_mjcf(osimlite.read(item.path), mujoco=3, folder=item.path.parent, name=item.id)
        files += mjcf.write(tmp_path / item.id)[:1]
        assert "for MuJoCo 3." in mjcf.text
    old, new = (
        subprocess.run(
            [python, "-c", READER, *map(str, files)], capture_output=True, text=True, check=True
        )
        for python in (older, sys.executable)
    )
    for first, second in zip(old.stdout.splitlines(), new.stdout.splitlines(), strict=True):
        (one, here), (two, there) = json.loads(first), json.loads(second)
        assert one == OLDER and two == mujoco.__version__
        np.testing.assert_allclose(here, there, rtol=0.0, atol=1e-12)


# ------------------------------------------------------------------------------------------------ records of losses
def test_a_body_without_a_joint_has_a_record():
    model = Model(name="loose")
    model.add(Body(name="ball", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    (record,) = to_mjcf(model).fidelity
    assert (record.kind, record.component) == ("loose-body", "/bodyset/ball")
    assert "rates of the angles" in record.done


def test_every_component_of_the_walker_is_accounted_for():
    model = dynamic_walker()
    mjcf = to_mjcf(model)
    assert unaccounted(model, mjcf) == []
    assert mjcf.fidelity.translated["/jointset/RightThighToPelvis/RHip_rz"] == "joint RHip_rz"
    assert mjcf.fidelity.translated["/jointset/PlatformToGround/platform_rz"].startswith("locked")
    assert {record.kind for record in mjcf.fidelity} == {"contact", "ellipsoid", "limit-force"}
    account = json.loads(mjcf.fidelity.to_json())
    assert account["target"] == "mjcf 4" and {record["how"] for record in account["records"]} == {
        "approximate"
    }


# -------------------------------------------------------------------------------------------------- names and files
def twins() -> Model:
    """Return two legs with equal coordinate names, on bodies with shapes and markers."""
    model = Model(name="two legs")
    for side in "lr":
        body = model.add(Body(name=f"leg_{side}", mass=1.0, inertia=(0.1, 0.1, 0.1, 0, 0, 0)))
        body.attach(
            Sphere(radius=0.1),
            Brick(half_lengths=(0.1, 0.2, 0.3)),
            Cylinder(radius=0.1, half_height=0.2),
        )
        joint = PinJoint(
            name=f"knee_{side}", coordinates=[Coordinate(name="angle", default_value=0.2)]
        )
        model.add(joint.between(model.ground, body))
        model.add(
            Marker(name=f"toe_{side}", socket_parent_frame=body.path, location=(0.1, 0.2, 0.3))
        )
    return model


def test_names_are_those_of_the_model_and_paths_where_two_share_one():
    mjcf = to_mjcf(twins())
    model = mujoco.MjModel.from_xml_string(mjcf.text)
    assert [model.body(k).name for k in range(model.nbody)] == ["world", "leg_l", "leg_r"]
    assert [model.joint(k).name for k in range(2)] == [
        "jointset.knee_l.angle",
        "jointset.knee_r.angle",
    ]
    assert {model.site(k).name for k in range(model.nsite)} == {"toe_l", "toe_r"}
    np.testing.assert_array_equal(model.site("toe_r").pos, (0.1, 0.2, 0.3))
    np.testing.assert_allclose(model.geom("leg_l_geom_2").size, (0.1, 0.2, 0.3), rtol=1e-15)
    # Visual shapes collide with nothing, and have no mass.
    assert not model.geom_contype.any() and not model.geom_conaffinity.any()
    assert model.body("leg_l").mass == 1.0
    # The camera is upright and looks along the horizon.
    np.testing.assert_allclose(
        model.camera("side").mat0.reshape(3, 3), np.eye(3), rtol=0.0, atol=1e-12
    )
    assert model.key("default").qpos.tolist() == [0.2, 0.2]


def test_ranges_are_there_and_limit_nothing():
    model = Compiled(to_mjcf(dynamic_walker())).model
    knee = model.joint("RKnee_rz")
    assert knee.range.tolist() == [np.radians(-100.0), 0.0] and not knee.limited[0]


def test_files_are_written_and_meshes_come_along(tmp_path, fixtures):
    model = twins()
    model["/bodyset/leg_l"].attach(
        Mesh(mesh_file="ascii.vtp"), Mesh(mesh_file="ascii.vtp", scale_factors=(1, 2, -1))
    )
    mjcf = osimlite.to_mjcf(model, folder=fixtures / "meshes", name="legs")
    assert isinstance(mjcf, Mjcf)
    written = mjcf.write(tmp_path / "out")
    assert [path.name for path in written] == [
        "legs.xml",
        "ascii.obj",
        "ascii_2.obj",
        "fidelity.json",
    ]
    compiled = mujoco.MjModel.from_xml_path(str(written[0]))
    assert compiled.nmesh == 2
    plain = to_mjcf(model, folder=fixtures / "meshes", visuals=False)
    assert plain.files == {} and "<geom" not in plain.text


# ---------------------------------------------------------------------------------- models that MuJoCo would reject
def test_what_mujoco_would_refuse_is_told_and_mended():
    model = Model(name="odd")
    below = model.ground
    for name, mass, inertia in (
        ("ghost", 0.0, (0.0,) * 6),
        ("odd", 1.0, (1.0, 1.0, 5.0, 0.1, 0, 0)),
    ):
        body = model.add(Body(name=name, mass=mass, inertia=inertia))
        kind = PinJoint if name == "ghost" else SliderJoint
        joint = kind(name=f"j_{name}", coordinates=[Coordinate(name=f"q_{name}")])
        model.add(joint.between(below, body))
        below = body
    mjcf = to_mjcf(model)
    told = {record.kind: record for record in mjcf.fidelity}
    assert (
        told["massless"].component == "/bodyset/ghost" and "mjMINVAL" in told["massless"].cannot_say
    )
    assert "balanceinertia" in told["inertia"].done and told["inertia"].errors[
        "moment"
    ].max == pytest.approx(3.1, abs=0.2)
    assert "singular" not in told
    compiled = mujoco.MjModel.from_xml_string(mjcf.text)
    assert compiled.body("ghost").mass < 1e-12
    model["/bodyset/odd"].mass, model["/bodyset/odd"].inertia = 0.0, (0.0,) * 6
    (record,) = (record for record in to_mjcf(model).fidelity if record.kind == "singular")
    assert "moves no mass" in record.detail


@pytest.mark.parametrize(
    ("choice", "said"),
    [
        ({"mujoco": 2}, "must be 3 or 4, not 2"),
        ({"contact": "soft"}, "'native' or 'none', not 'soft'"),
    ],
)
def test_choices_that_are_none_are_refused(choice, said):
    with pytest.raises(OsimliteError, match=said):
        to_mjcf(dynamic_walker(), **choice)
