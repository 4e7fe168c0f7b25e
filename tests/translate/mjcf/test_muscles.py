"""Tests of muscles as MuJoCo computes them, against those of the model."""

from __future__ import annotations

from math import cos

import mujoco
import numpy as np
import pytest

import osimlite
from osimlite.base.text import add_article
from osimlite.models.arm import arm
from osimlite.schema.path_forces import PathSpring
from osimlite.schema.paths import GeometryPath, PathPoint
from osimlite.translate import to_mjcf
from osimlite.translate.mjcf.isometric import compute_isometric_tension
from osimlite.translate.mjcf.muscles import Curves


def gait(corpus):
    return osimlite.read(next(item.path for item in corpus if item.id == "m0005"))


def test_fibers_and_tendons_keep_their_lengths(corpus):
    model = gait(corpus)
    compiled = mujoco.MjModel.from_xml_string(to_mjcf(model, visuals=False).text)
    for path in ("soleus_r", "vasti_l", "glut_max_r"):
        muscle, actuator = model[f"/forceset/{path}"], compiled.actuator(path)
        low, high = actuator.lengthrange
        first, last = actuator.gainprm[:2]
        fiber = (high - low) / (last - first)
        angle = muscle.pennation_angle_at_optimal
        assert fiber == pytest.approx(muscle.optimal_fiber_length * cos(angle), rel=1e-12)
        assert low - first * fiber == pytest.approx(muscle.tendon_slack_length, rel=1e-12)
        assert actuator.gainprm[2] == pytest.approx(
            muscle.max_isometric_force * cos(angle), rel=1e-12
        )
        assert actuator.dynprm[:2].tolist() == [
            muscle.activation_time_constant,
            muscle.deactivation_time_constant,
        ]


@pytest.mark.parametrize(
    ("is_rigid", "angle", "features"),
    [
        (True, 0.0, "non-parabolic curves"),
        (True, 0.3, "fibers at a changing angle, non-parabolic curves"),
        (False, 0.0, "an elastic tendon, non-parabolic curves"),
        (False, 0.3, "an elastic tendon, fibers at a changing angle, non-parabolic curves"),
    ],
)
def test_the_account_names_only_what_a_muscle_has(is_rigid, angle, features):
    model = arm()
    muscle = model["/forceset/flexor"]
    muscle.ignore_tendon_compliance = is_rigid
    muscle.pennation_angle_at_optimal = angle
    (record,) = [
        record
        for record in to_mjcf(model, visuals=False).fidelity
        if (record.kind, record.component) == ("muscle", "/forceset/flexor")
    ]
    assert record.cannot_say == f"{add_article(type(muscle).__name__)}: {features}"


@pytest.mark.parametrize("activation", [0.0, 0.3, 1.0])
def test_tension_is_mujocos(activation):
    curves = Curves(0.2, 0.1, 500.0, 0.4, 1.7, 1.5, 1.2, 0.13)
    gain, bias = (" ".join(map(str, row)) for row in curves.make_parameters(10.0, 1.4))
    model = mujoco.MjModel.from_xml_string(f"""<mujoco><worldbody><site name="a"/>
        <body><joint name="x" type="slide"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><site name="b"/></body>
        </worldbody><tendon><spatial name="t"><site site="a"/><site site="b"/></spatial></tendon>
        <actuator><general tendon="t" lengthrange="0.2 0.3" dyntype="none" gaintype="muscle" biastype="muscle"
        gainprm="{gain}" biasprm="{bias}"/></actuator></mujoco>""")
    data, lengths, result = mujoco.MjData(model), np.linspace(0.22, 0.45, 40), []
    for length in lengths:
        data.qpos[0], data.ctrl[0] = length, activation
        mujoco.mj_forward(model, data)
        result.append(-data.actuator_force[0])
    np.testing.assert_allclose(
        curves.compute_tension(lengths, activation), result, rtol=1e-12, atol=1e-9
    )
    read = Curves.read(
        model.actuator_lengthrange[0], model.actuator_gainprm[0], model.actuator_biasprm[0]
    )
    assert read == pytest.approx(curves)


def test_isometric_forces_are_near_and_nearer_if_fitted(corpus):
    model = gait(corpus)
    worst = {}
    for fit in ("none", "force"):
        fidelity = to_mjcf(model, visuals=False, fit=fit).fidelity
        errors = [
            record.errors["isometric force"].rms for record in fidelity if record.kind == "muscle"
        ]
        assert len(errors) == 18
        worst[fit] = np.median(errors)
    assert worst["force"] < worst["none"] < 0.04


def test_a_slack_spring_pulls_nothing(corpus):
    model = gait(corpus)
    path = GeometryPath(name="path")
    for name, frame in (("a", "/ground"), ("b", "/bodyset/pelvis")):
        path.path_point_set.objects.append(
            PathPoint(name=name, socket_parent_frame=frame, location=(0.0, 0.1, 0.0))
        )
    model.add(
        PathSpring(
            name="cord", geometry_path=path, resting_length=0.3, stiffness=200.0, dissipation=0.1
        )
    )
    mjcf = to_mjcf(model, visuals=False)
    assert "damping" in {record.kind for record in mjcf.fidelity}
    compiled = mujoco.MjModel.from_xml_string(mjcf.text)
    data = mujoco.MjData(compiled)
    place = compiled.joint("pelvis_tx").qposadr[0]
    for stretch in (-0.1, 0.05):
        data.qpos[:] = 0.0
        data.qpos[place] = 0.3 + stretch
        mujoco.mj_forward(compiled, data)
        expected = compute_isometric_tension(
            model["/forceset/cord"], np.array([0.3 + stretch]), (0.0,)
        )
        assert -data.qfrc_spring[compiled.joint("pelvis_tx").dofadr[0]] == pytest.approx(
            expected.item(), abs=1e-9
        )


def test_the_activation_of_a_muscle_with_a_mass_lags_too(corpus):
    old = gait(corpus)["/forceset/soleus_r"]
    muscle = osimlite.Millard2012AccelerationMuscle(
        name="soleus_r", max_isometric_force=old.max_isometric_force
    )
    muscle.optimal_fiber_length, muscle.tendon_slack_length = (
        old.optimal_fiber_length,
        old.tendon_slack_length,
    )
    muscle.muscle_first_order_activation_dynamic_model.activation_time_constant = 0.012
    muscle.geometry_path = old.geometry_path.copy_deep()
    model = gait(corpus)
    forces = model.force_set.objects
    forces[[force.name for force in forces].index("soleus_r")] = muscle
    compiled = mujoco.MjModel.from_xml_string(to_mjcf(model, visuals=False).text)
    assert compiled.actuator("soleus_r").dynprm[:2].tolist() == [0.012, 0.04]
