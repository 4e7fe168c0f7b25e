"""Tests of tendons, muscles and other actuators of MJCF files in OpenSim."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.errors import SettingError

mujoco = pytest.importorskip("mujoco", reason="needs mujoco (extra 'mujoco')")

from osimlite.translate.mjcf_import.poses import compute_poses, sample_qpos  # noqa: E402
from osimlite.translate.mjcf_import.source import load_mjcf  # noqa: E402
from osimlite.translate.mjcf_import.tendon_lengths import (  # noqa: E402
    read_tendon,
    tendon_lengths,
)
from tests.translate.mjcf_import import comparison, models  # noqa: E402

VERSION = int(mujoco.__version__.split(".")[0])


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    return models.write_mjcf(tmp_path_factory.mktemp("arm"), models.ARM)


@pytest.fixture(scope="module")
def made(arm):
    return osimlite.from_mjcf(arm, written_for=VERSION)


@pytest.fixture(scope="module")
def records(made):
    return {record.component: record for record in made.fidelity}


def test_lengths_by_our_rules_are_mujocos(arm):
    source = load_mjcf(arm)
    qpos = sample_qpos(source, 50, 4)
    tendons = [read_tendon(source, index) for index in range(source.model.ntendon)]
    lengths = tendon_lengths(source, tendons, compute_poses(source, qpos), source.major)
    data = mujoco.MjData(source.model)
    for pose, column in zip(qpos, lengths.T, strict=True):
        data.qpos[:] = pose
        mujoco.mj_fwdPosition(source.model, data)
        assert np.abs(column - data.ten_length).max() < 1e-12


def test_paths_are_as_long_as_tendons(arm, made, records):
    source = load_mjcf(arm)
    model = source.model
    data, paths = mujoco.MjData(model), osimlite.paths(made.model)
    owners = {"straight": "m_straight", "over": "m_over", "round": "m_round", "both": "linear"}
    owners |= {"through": "m_through", "pulley": "m_pulley", "elastic": "elastic_spring"}
    shifts = {"both": float(records["/tendon/both"].detail.split()[1])}
    for pose in sample_qpos(source, 30, 9):
        data.qpos[:] = pose
        mujoco.mj_fwdPosition(model, data)
        lengths = paths.lengths(made.coordinates.values(pose))
        for name, owner in owners.items():
            record = records.get(f"/tendon/{name}")
            allowed = 3.0 * record.errors["length"].max if record and record.errors else 1e-12
            off = (
                lengths[f"/forceset/{owner}"] - shifts.get(name, 0.0) - data.tendon(name).length[0]
            )
            assert abs(off) <= allowed + 1e-12, name
    assert records["/tendon/through"].errors["length"].rms < 1e-3
    assert "polynomial" in records["/tendon/through"].done
    assert "polynomial" in records["/tendon/pulley"].done
    assert records["/tendon/loose"].cannot_say == "a tendon without a force"
    assert records["/actuator/mixed"].how == "dropped"


def test_moment_arms_are_rates_of_tendons(arm, made, records):
    source = load_mjcf(arm)
    model, data, paths = source.model, mujoco.MjData(source.model), osimlite.paths(made.model)
    owners = {"straight": "m_straight", "over": "m_over", "round": "m_round", "both": "linear"}
    owners |= {"through": "m_through", "pulley": "m_pulley", "elastic": "elastic_spring"}
    # Differentiate MuJoCo's lengths, because the layout of its Jacobian depends on the version.
    step = 1e-5
    errors = {name: [] for name in owners}
    for pose in sample_qpos(source, 30, 6):
        arms = paths.moment_arms(made.coordinates.values(pose))
        for joint in range(model.njnt):
            lengths = []
            for change in (-step, step):
                data.qpos[:] = pose
                data.qpos[model.jnt_qposadr[joint]] += change
                mujoco.mj_fwdPosition(model, data)
                lengths.append(data.ten_length.copy())
            rates = (lengths[1] - lengths[0]) / (2.0 * step)
            for name, owner in owners.items():
                by_coordinate = {
                    coordinate.rpartition("/")[2]: value
                    for coordinate, value in arms[f"/forceset/{owner}"].items()
                }
                # OpenSim's moment arm is the negative derivative of the length.
                value = -by_coordinate.get(model.joint(joint).name, 0.0)
                errors[name].append(value - rates[model.tendon(name).id])
    for name in ("through", "pulley"):
        recorded = records[f"/tendon/{name}"].errors["moment arm"].rms
        assert np.sqrt(np.mean(np.square(errors.pop(name)))) < 2.0 * recorded
    assert np.abs(list(errors.values())).max() < 1e-8


@pytest.mark.oracle
@pytest.mark.parametrize("muscle_class", ["exact", "millard"])
def test_forces_are_mujocos_in_opensim(arm, tmp_path, muscle_class):
    pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
    made = osimlite.from_mjcf(arm, muscle_class=muscle_class, armature="none", written_for=VERSION)
    live = comparison.LiveForces(comparison.LiveModel(made, tmp_path), made)
    random = np.random.default_rng(3)
    allowed = dict.fromkeys(("motor", "servo", "speed", "pull", "linear", "push", "twist"), 1e-11)
    muscles = ("m_straight", "m_round", "m_over", "m_joint", "m_through", "m_pulley")
    allowed |= dict.fromkeys(muscles, 1e-11 if muscle_class == "exact" else 4.0)
    if muscle_class == "exact":
        allowed |= {"m_through": 0.02, "m_pulley": 0.5}
        # OpenSim's path over a cylinder is not exactly the shortest.
        allowed |= {"m_over": 0.1}
    if muscle_class == "millard":
        allowed = {name: limit for name, limit in allowed.items() if name in muscles}
    for pose in sample_qpos(load_mjcf(arm), 6, 5):
        qvel, control = random.uniform(-1.0, 1.0, len(pose)), random.uniform(0.1, 1.0)
        for name, limit in allowed.items():
            theirs = comparison.actuator_torques(arm, pose, qvel, control, name)
            ours = live.torques(pose, qvel, control, [name, f"{name}_bias"])
            assert np.abs(ours - theirs).max() <= limit, name


def test_muscles_have_fitted_curves(made, records):
    muscle = made.model["/forceset/m_over"]
    assert type(muscle).__name__ == "Millard2012EquilibriumMuscle"
    assert muscle.ignore_tendon_compliance and not muscle.ignore_activation_dynamics
    assert (muscle.activation_time_constant, muscle.deactivation_time_constant) == (0.015, 0.06)
    # The tendon slack length must be positive; the optimal fiber length is reduced by the
    # difference.
    fiber, slack = 0.2 / 0.7, 0.15 - 0.6 * 0.2 / 0.7
    assert slack < 0.0 < muscle.tendon_slack_length == 1e-4
    assert muscle.optimal_fiber_length == pytest.approx(fiber + slack - 1e-4)
    for name in ("m_straight", "m_over", "m_round"):
        errors = records[f"/actuator/{name}"].errors
        assert errors["force-velocity"].rms < 0.01
        assert errors["passive force-length"].rms < 0.01
        assert errors["active force-length"].rms < 0.06


def test_the_model_simulates(made):
    assert osimlite.validate(made.model).ok
    trajectory = osimlite.simulate(made.model, to=0.02, controls={"m_straight": 0.3})
    assert np.isfinite(trajectory.values).all()


def test_the_version_is_asked_for_where_it_matters(tmp_path):
    path = models.write_mjcf(tmp_path, models.SIDES)
    with pytest.raises(SettingError, match=r"'t' by up to .* m; .* --written-for 3"):
        osimlite.from_mjcf(path)
    made = osimlite.from_mjcf(path, written_for=3)
    newer = osimlite.from_mjcf(path, written_for=4)
    older_paths, newer_paths = (osimlite.paths(either.model) for either in (made, newer))
    differences = [
        abs(older_paths.lengths([q])[name] - length)
        for q in np.linspace(-0.5, 2.5, 61)
        for name, length in newer_paths.lengths([q]).items()
    ]
    assert max(differences) == pytest.approx(0.105, abs=0.01)


@pytest.mark.parametrize("up", ["z", "y"])
def test_geodesics_are_nearer_than_wrap_objects(arm, up):
    def measure(option):
        made = osimlite.from_mjcf(arm, written_for=4, tendon_paths=option, up=up)
        records = {record.component: record for record in made.fidelity}
        paths = {
            muscle.name: type(muscle.geometry_path).__name__
            for muscle in made.model.components(osimlite.Muscle)
        }
        over = records.get("/tendon/over")
        return paths, over.errors["length"].max if over else 0.0

    before, wrapped = measure("wraps")
    after, geodesic = measure("geodesics")
    assert "Scholz2015GeometryPath" not in before.values()
    # After a rotation of the world, the frame of the first points is an offset frame, not a body.
    assert (after["m_over"] == "Scholz2015GeometryPath") == (wrapped > 1e-6)
    assert geodesic <= max(min(wrapped, 1e-6), 0.0)
    assert after["m_through"] == before["m_through"]


def test_sites_in_one_place_are_recorded(tmp_path):
    """OpenSim computes NaN where neighbouring points on two bodies coincide."""
    text = """<mujoco><worldbody>
<body><joint type="hinge" axis="0 1 0"/><geom type="sphere" size=".2" pos="1 0 0"/><site name="inner" pos="1 0 0"/>
<site name="other" pos="1 0 0"/></body><site name="outer" pos="1 0 0"/></worldbody>
<tendon><spatial name="t" stiffness="2"><site site="outer"/><site site="inner"/><site site="other"/></spatial></tendon>
<keyframe><key name="apart" qpos="1"/></keyframe></mujoco>"""
    path = models.write_mjcf(tmp_path, text)

    def find(keyframe):
        return [
            record.detail
            for record in osimlite.from_mjcf(path, keyframe=keyframe).fidelity
            if record.component == "/tendon/t" and "at the same position" in record.cannot_say
        ]

    assert find(None) == ["'outer' and 'inner'"]
    assert find("apart") == []


FLOATING = """<mujoco>
  <worldbody>
    <site name="a" pos="0.3 0.02 1"/>
    <geom name="rod" type="cylinder" size="0.05 0.2" zaxis="0 1 0" pos="0 0 0.5"/>
    <site name="side" pos="0 0 0.56"/>
    <site name="inside" pos="0 0 0.5"/>
    <body name="ball" pos="0 0 0.1">
      <freejoint/>
      <geom size="0.05"/>
      <site name="b" pos="0 0 0.02"/>
      <site name="c" pos="0.02 0 0.02"/>
    </body>
  </worldbody>
  <tendon>
    <spatial name="around"><site site="a"/><geom geom="rod" sidesite="side"/><site site="b"/></spatial>
    <spatial name="within"><site site="a"/><geom geom="rod" sidesite="inside"/><site site="b"/></spatial>
    <spatial name="branched">
      <site site="a"/><site site="b"/><pulley divisor="2"/><site site="side"/><site site="c"/>
    </spatial>
  </tendon>
  <actuator>
    <motor name="m_around" tendon="around"/>
    <motor name="m_within" tendon="within"/>
    <motor name="m_branched" tendon="branched"/>
  </actuator>
</mujoco>
"""
"""Tendons that only move with a free joint and therefore have no polynomial of coordinates."""


def test_tendons_of_free_bodies_have_paths_without_polynomials(tmp_path):
    made = osimlite.from_mjcf(models.write_mjcf(tmp_path, FLOATING), written_for=4)
    records = {record.component: record for record in made.fidelity}
    for name in ("around", "within", "branched"):
        path = made.model[f"/forceset/m_{name}"].geometry_path
        assert [point.name for point in path.path_point_set.objects] == ["a", "b"]
    assert records["/tendon/within"].done == "a GeometryPath, straight between the sites"
    assert records["/tendon/branched"].done == (
        "a GeometryPath through the sites of the first branch, straight between them"
    )
    # The record states the errors of such paths.
    assert 0.0 < records["/tendon/within"].errors["length"].max < 0.2
    assert records["/tendon/branched"].errors["length"].max > 0.2
    assert osimlite.read_text(made.text).name == made.model.name


SEVERAL = """<mujoco>
  <worldbody>
    <body>
      <joint name="ball" type="ball"/>
      <geom size="0.1"/>
      <body pos="0 0 0.3">
        <joint name="hinge" axis="0 1 0"/>
        <geom size="0.1"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <orientation name="turn" joint="ball" kp="1"/>
    <motor name="pull" joint="hinge" gear="7" ctrlrange="-2 3"/>
  </actuator>
</mujoco>
"""
"""Actuator with three controls and outputs, before an actuator with one of each."""


@pytest.mark.skipif(VERSION < 4, reason="needs a MuJoCo whose actuators have several controls")
def test_actuators_after_those_with_several_controls_keep_their_numbers(tmp_path):
    made = osimlite.from_mjcf(models.write_mjcf(tmp_path, SEVERAL))
    motor = made.model["/forceset/pull"]
    assert motor.optimal_force == 7.0
    assert (motor.min_control, motor.max_control) == (-2.0, 3.0)
    records = {record.component: record for record in made.fidelity}
    assert records["/actuator/turn"].cannot_say == "an actuator with several controls or outputs"
    assert records["/actuator/turn"].how == "dropped"
