"""Tests of constraints and contact in MuJoCo: what holds, and with which error."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import osimlite
from osimlite import (
    Body,
    ConstantDistanceConstraint,
    ContactHalfSpace,
    ContactMesh,
    ContactSphere,
    Coordinate,
    FreeJoint,
    HuntCrossleyForce,
    PointConstraint,
    PointOnLineConstraint,
    RollingOnSurfaceConstraint,
    SliderJoint,
    WeldConstraint,
)
from osimlite.mechanics.multibody.spatial import angles_xyz
from osimlite.translate import to_mjcf
from tests.translate.mjcf.compiled import Compiled
from tests.translate.mjcf.support import A, chain

B = "/bodyset/b2"


def settled(model, seconds: float = 0.2) -> tuple[Compiled, np.ndarray]:
    """Simulate a translation from its default pose.

    Returns:
        Compiled translation, and final coordinates.
    """
    compiled = Compiled(to_mjcf(model))
    mujoco.mj_resetDataKeyframe(compiled.model, compiled.data, 0)
    for _ in range(int(seconds / compiled.model.opt.timestep)):
        mujoco.mj_step(compiled.model, compiled.data)
    names = osimlite.mechanism(model).coordinate_names
    return compiled, np.array([compiled.data.joint(name).qpos[0] for name in names])


def on(frame: str, *point: float) -> tuple[float, ...]:
    """Return the position (m) in ground of a point of a body, in a pose near the default pose."""
    mechanism = osimlite.mechanism(chain())
    return tuple(mechanism.station_position(frame, point, mechanism.values({}) + 0.05).tolist())


CONSTRAINTS = {
    "point": lambda: PointConstraint(
        name="c",
        socket_body_1="/ground",
        socket_body_2=B,
        location_body_1=on(B, 0.1, 0.0, 0.1),
        location_body_2=(0.1, 0.0, 0.1),
    ),
    "distance": lambda: ConstantDistanceConstraint(
        name="c",
        socket_body_1="/ground",
        socket_body_2=B,
        location_body_1=(0.2, -0.3, 0),
        constant_distance=0.9,
    ),
    "line": lambda: PointOnLineConstraint(
        name="c",
        socket_line_body="/ground",
        line_direction_vec=(1.0, 0.3, 0.2),
        point_on_line=on("/bodyset/b3", 0.1, 0.05, 0.0),
        socket_follower_body="/bodyset/b3",
        point_on_follower=(0.1, 0.05, 0.0),
    ),
}


@pytest.mark.parametrize("make", CONSTRAINTS.values(), ids=CONSTRAINTS)
def test_constraints_hold_from_the_default_pose_on(make):
    model, constraint = chain(), make()
    model.constraint_set.objects.append(constraint)
    mechanism = osimlite.mechanism(model)
    (bond,) = (item for item in mechanism.constraints if item.name == constraint.path)
    compiled = Compiled(to_mjcf(model))
    mujoco.mj_resetDataKeyframe(compiled.model, compiled.data, 0)
    mujoco.mj_forward(compiled.model, compiled.data)
    assert np.abs(compiled.data.efc_pos).max() < 1e-9
    _, q = settled(model)
    assert np.abs(bond.position_errors(mechanism.at(q))).max() < 2e-4
    assert np.abs(q - mechanism.default_state()[0]).max() > 0.01


def test_a_weld_holds_two_frames_on_each_other():
    model = chain()
    held = Body(name="held", mass=1.0, inertia=(0.1, 0.1, 0.1, 0, 0, 0))
    mechanism = osimlite.mechanism(model)
    hook = mechanism.frame_transform("/componentset/hook", mechanism.values({}))
    near = (*(angles_xyz(hook[:3, :3]) + 0.05), *hook[:3, 3])
    coordinates = [Coordinate(name=f"h{k}", default_value=value) for k, value in enumerate(near)]
    model.add(held)
    model.add(FreeJoint(name="free", coordinates=coordinates).between(model.ground, held))
    weld = WeldConstraint(
        name="c", socket_frame1="/componentset/hook", socket_frame2="/bodyset/held"
    )
    model.constraint_set.objects.append(weld)
    (bond,) = (item for item in osimlite.mechanism(model).constraints if item.name == weld.path)
    _, q = settled(model, 0.1)
    assert np.abs(bond.position_errors(osimlite.mechanism(model).at(q))).max() < 2e-4


def test_a_constraint_that_mujoco_has_not_is_told():
    model = chain()
    rolling = RollingOnSurfaceConstraint(
        name="c", socket_rolling_body=A, socket_surface_body="/ground"
    )
    model.constraint_set.objects.append(rolling)
    assert [(r.component, r.how) for r in to_mjcf(model).fidelity if r.kind == "constraint"] == [
        (rolling.path, "dropped")
    ]


# ------------------------------------------------------------------------------------------------------- contact
def falling(*, on_a_body: bool = False):
    """Return a ball above a tilted floor, which is fixed to ground or to a body that can move."""
    model = osimlite.Model(name="fall")
    ball = model.add(Body(name="ball", mass=2.0, inertia=(0.01, 0.01, 0.01, 0, 0, 0)))
    values = (0.0, 0.0, 0.0, 0.1, 0.3, 0.0)
    coordinates = [Coordinate(name=f"c{k}", default_value=value) for k, value in enumerate(values)]
    model.add(FreeJoint(name="free", coordinates=coordinates).between(model.ground, ball))
    below = "/ground"
    if on_a_body:
        floor = model.add(Body(name="floor", mass=50.0, inertia=(1, 1, 1, 0, 0, 0)))
        slide = SliderJoint(name="slide", coordinates=[Coordinate(name="lift")])
        model.add(slide.between(model.ground, floor))
        below = floor.path
    quarter = -np.pi / 2
    model.add(
        ContactHalfSpace(
            name="plane", socket_frame=below, orientation=(0.0, 0.0, quarter), location=(0, 0.05, 0)
        ),
        ContactSphere(name="sphere", socket_frame=ball.path, radius=0.1, location=(0.0, 0.02, 0.0)),
    )
    law = HuntCrossleyForce(name="law")
    material = HuntCrossleyForce.ContactParameters(
        geometry=("plane", "sphere"), stiffness=1e6, dynamic_friction=0.5
    )
    law.contact_parameters.objects.append(material)
    model.add(law)
    return model


@pytest.mark.parametrize("on_a_body", [False, True])
def test_a_ball_comes_to_lie_on_a_half_space(on_a_body):
    model = falling(on_a_body=on_a_body)
    compiled, _ = settled(model, 1.5)
    assert compiled.data.body("ball").xpos[1] == pytest.approx(0.05 + 0.1 - 0.02, abs=5e-3)
    (record,) = (record for record in to_mjcf(model).fidelity if record.kind == "contact")
    assert (
        record.how == "approximate"
        and "differ" in record.done
        and record.detail == "pairs plane.sphere"
    )


def test_without_contact_it_falls_through_and_that_is_told():
    mjcf = to_mjcf(falling(), contact="none")
    assert "<pair" not in mjcf.text and "touches" not in mjcf.text
    assert {record.kind for record in mjcf.fidelity if record.how == "dropped"} == {
        "force",
        "contact-geometry",
    }


@pytest.mark.parametrize("stiffness", [0.0, -1.0])
def test_a_contact_without_stiffness_supports_nothing(stiffness):
    model = falling()
    (law,) = model.force_set.objects
    law.contact_parameters.objects[0].stiffness = stiffness
    mjcf = to_mjcf(model)
    assert "<pair" not in mjcf.text
    (record,) = (record for record in mjcf.fidelity if record.kind == "contact")
    assert record.done == "left out: a stiffness of its surfaces is not positive"


def test_a_mesh_touches_by_its_convex_hull(tmp_path):
    (tmp_path / "wedge.obj").write_text(
        "v 0 0 0\nv .2 0 0\nv 0 .2 0\nv 0 0 .2\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    )
    model = falling()
    model.add(ContactMesh(name="mesh", socket_frame="/bodyset/ball", filename="wedge.obj"))
    model["/forceset/law"].contact_parameters.objects[0].geometry = ("plane", "mesh")
    mjcf = to_mjcf(model, folder=tmp_path)
    compiled = Compiled(mjcf)
    assert compiled.model.npair == 1
    assert ("contact-geometry", "its convex hull") in {
        (record.kind, record.done) for record in mjcf.fidelity
    }
    gone = to_mjcf(model)
    assert "<pair" not in gone.text and [
        record.how for record in gone.fidelity if record.kind == "mesh"
    ] == ["dropped"]
