"""Tests of the time step of a file, and of warnings about models that no time step makes stable."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest

from osimlite import (
    BushingForce,
    GeometryPath,
    Millard2012EquilibriumMuscle,
    Model,
    PathPoint,
    PointToPointSpring,
)
from osimlite.translate import to_mjcf
from tests.simple_models import make_slide
from tests.translate.mjcf.compiled import Compiled

BLOCK = "/bodyset/block"


def sled(*forces: Any) -> Model:
    """Return a block of 2 kg on a slide, 0.1 m from ground."""
    return make_slide(
        *forces, coordinate="slide_coord_0", default_value=0.1, body="block", mass=2.0
    )


def spring(stiffness: float) -> PointToPointSpring:
    return PointToPointSpring(
        name="f", socket_body1="/ground", socket_body2=BLOCK, stiffness=stiffness, rest_length=0.05
    )


def bushing(damping: float) -> BushingForce:
    return BushingForce(
        name="f",
        socket_frame1="/ground",
        socket_frame2=BLOCK,
        translational_damping=(damping, 0.0, 0.0),
    )


def muscle(fiber: float) -> Millard2012EquilibriumMuscle:
    path = GeometryPath(name="path")
    for name, frame in (("a", "/ground"), ("b", BLOCK)):
        path.path_point_set.objects.append(PathPoint(name=name, socket_parent_frame=frame))
    return Millard2012EquilibriumMuscle(
        name="f",
        geometry_path=path,
        optimal_fiber_length=fiber,
        tendon_slack_length=0.02,
        max_isometric_force=100.0,
    )


@pytest.mark.parametrize(
    ("force", "step", "rate"),
    [
        (spring(2.0 * 1990.0**2), 1e-3, None),
        (spring(2.0 * 8000.0**2), 1e-4, "8e+03"),
        (bushing(2.0 * 1990.0), 1e-3, None),
        (bushing(2.0 * 5e4), 2e-5, "5e+04"),
    ],
)
def test_the_step_is_shorter_than_what_springs_do(force, step, rate):
    mjcf = to_mjcf(sled(force))
    model = Compiled(mjcf).model
    assert model.opt.timestep == step
    assert [
        f"{rate} 1/s" in record.detail for record in mjcf.fidelity if record.kind == "stiff"
    ] == [True] * bool(rate)


def test_a_stiff_spring_keeps_its_energy():
    compiled = Compiled(to_mjcf(sled(spring(2.0 * 8000.0**2))))
    mujoco.mj_resetDataKeyframe(compiled.model, compiled.data, 0)
    for _ in range(10_000):
        mujoco.mj_step(compiled.model, compiled.data)
        assert np.abs(compiled.data.qpos).max() < 0.2


@pytest.mark.parametrize(("fiber", "told"), [(0.03, 1), (0.08, 0)])
def test_torn_muscles_are_told(fiber, told):
    records = [
        record for record in to_mjcf(sled(muscle(fiber))).fidelity if record.kind == "overstretched"
    ]
    assert len(records) == told
    assert all(record.component == "/forceset/f" for record in records)


def test_a_muscle_that_has_no_tension_hinders_nobody():
    impossible = muscle(0.08)
    impossible.name, impossible.minimum_activation = "impossible", -1.0
    mjcf = to_mjcf(sled(impossible, spring(2.0 * 8000.0**2)))
    assert "overstretched" not in {record.kind for record in mjcf.fidelity}
    assert Compiled(mjcf).model.opt.timestep == 1e-4


def test_a_spring_that_is_left_out_hides_no_stiff_one():
    loose = spring(1.0)
    loose.name, loose.socket_body2 = "loose", "/bodyset/nobody"
    mjcf = to_mjcf(sled(loose, spring(2.0 * 8000.0**2)))
    assert Compiled(mjcf).model.opt.timestep == 1e-4
    (record,) = (record for record in mjcf.fidelity if record.kind == "stiff")
    assert record.done == "the file sets smaller steps"


def test_a_muscle_that_is_left_out_has_one_record():
    pushing = muscle(0.03)
    pushing.max_isometric_force = -100.0
    records = [
        record for record in to_mjcf(sled(pushing)).fidelity if record.component == "/forceset/f"
    ]
    assert [record.kind for record in records] == ["force"]


def test_messages_about_a_tension_name_the_muscle():
    impossible = muscle(0.08)
    impossible.name, impossible.minimum_activation = "impossible", -1.0
    (record,) = (record for record in to_mjcf(sled(impossible)).fidelity if record.kind == "force")
    assert "'/forceset/impossible'" in record.done
