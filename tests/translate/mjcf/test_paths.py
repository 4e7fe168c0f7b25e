"""Tests of the lengths of tendons in MuJoCo against the paths of the model."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

import osimlite
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.frames import Body
from osimlite.schema.function_types import Sine
from osimlite.schema.joints import PinJoint, SliderJoint
from osimlite.schema.model import Model
from osimlite.schema.muscles import PathActuator
from osimlite.schema.path_forces import PathSpring
from osimlite.schema.paths import (
    ConditionalPathPoint,
    GeometryPath,
    MovingPathPoint,
    PathPoint,
    PathWrap,
)
from osimlite.schema.wrap_types import WrapCylinder
from osimlite.translate import to_mjcf
from osimlite.translate.mjcf.poses import draw_values
from tests.translate.mjcf.compiled import Compiled

POSES = 30


def errors(model, **options):
    """Translate a model, and compare its tendons at random poses.

    Args:
        model: the model.
        options: options of the translation.

    Returns:
        Translation, and errors of the length (m) at all poses, by muscle.
    """
    mjcf = to_mjcf(model, visuals=False, **options)
    compiled, paths = Compiled(mjcf), osimlite.paths(model)
    result = {name.rpartition("/")[2]: [] for name in paths.names}
    for q in draw_values(paths.mechanism, POSES, 5):
        compiled.place(q)
        for name, length in paths.lengths(q).items():
            muscle = name.rpartition("/")[2]
            result[muscle].append(compiled.data.tendon(muscle).length[0] - length)
    return mjcf, {name: np.array(row) for name, row in result.items()}


def of(corpus, number):
    return osimlite.read(next(item.path for item in corpus if item.id == number))


def test_lengths_are_off_by_what_fidelity_says(corpus):
    mjcf, result = errors(of(corpus, "m0005"))
    said = {
        record.detail.removeprefix("tendon "): record.errors["length"]
        for record in mjcf.fidelity
        if record.kind == "path"
    }
    assert {"iliopsoas_r", "rect_fem_r", "vasti_l"} <= said.keys()
    assert "soleus_r" not in said
    for name, off in result.items():
        if name in said:
            assert np.sqrt(np.mean(off**2)) < 2.0 * said[name].rms + 1e-6
        else:
            assert np.abs(off).max() < 1e-9


def test_points_that_come_and_go_are_where_openSim_has_them(corpus):
    _, result = errors(of(corpus, "m0005"))
    for name in ("iliopsoas_r", "iliopsoas_l", "gastroc_r", "gastroc_l"):
        assert np.abs(result[name]).max() < 2e-5


def test_a_locked_coordinate_moves_no_point(corpus):
    model = of(corpus, "m0005")
    knee = model["/jointset/knee_r/knee_angle_r"]
    knee.locked, knee.default_value = True, -1.0
    _, result = errors(model)
    assert np.abs(result["vasti_r"]).max() < 3e-4
    assert np.abs(result["soleus_r"]).max() < 1e-9


@pytest.mark.parametrize("carrier", ["/ground", "/bodyset/arm"])
def test_a_point_that_moves_stays_where_it_must_under_load(carrier):
    model = Model(name="sliding")
    body = model.add(Body(name="arm", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    model.add(
        PinJoint(name="pin", coordinates=[Coordinate(name="q", range=(-1.0, 1.0))]).between(
            model.ground, body
        )
    )
    path = GeometryPath(name="path")
    guided = MovingPathPoint(name="a", socket_parent_frame=carrier)
    for axis, size in zip("xyz", (0.1, 0.2, 0.05), strict=True):
        setattr(guided, f"socket_{axis}_coordinate", "/jointset/pin/q")
        setattr(guided, f"{axis}_location", Sine(amplitude=size, omega=1.5, phase=10.0 * size))
    other = PathPoint(name="b", socket_parent_frame="/bodyset/arm", location=(0.3, 0.4, 0.0))
    if carrier != "/ground":
        other.socket_parent_frame = "/ground"
    path.path_point_set.objects += [guided, other]
    model.add(
        PathSpring(
            name="cord", geometry_path=path, resting_length=0.1, stiffness=500.0, dissipation=0.0
        )
    )
    compiled = Compiled(to_mjcf(model, visuals=False))
    mujoco.mj_resetDataKeyframe(compiled.model, compiled.data, 0)
    for _ in range(100):
        mujoco.mj_step(compiled.model, compiled.data)
    mujoco.mj_forward(compiled.model, compiled.data)
    q = compiled.data.joint("q").qpos[0]
    assert q == pytest.approx(
        osimlite.simulate(model, to=0.1, accuracy=1e-9).values[-1, 0], rel=0.01
    )
    length = osimlite.paths(model).lengths({"q": q})["/forceset/cord"]
    assert compiled.data.tendon("cord").length[0] == pytest.approx(length, abs=1e-4)


def test_odd_paths_come_to_an_end():
    model = Model(name="odd")
    body = model.add(Body(name="arm", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    slide = SliderJoint(name="slide")
    slide.coordinates[0].name = "x"
    slide.coordinates[0].range = (-math.inf, math.inf)
    model.add(slide.between(model.ground, body))
    body.WrapObjectSet.objects.append(WrapCylinder(name="line", radius=0.0, length=1.0))
    path = GeometryPath(name="path")
    middle = ConditionalPathPoint(
        name="b", socket_coordinate="/jointset/slide/x", range=(0.2, -0.2)
    )
    for point, frame in (
        (PathPoint(name="a"), "/ground"),
        (middle, "/ground"),
        (PathPoint(name="c"), "/bodyset/arm"),
    ):
        point.socket_parent_frame = frame
        path.path_point_set.objects.append(point)
    path.path_wrap_set.objects.append(PathWrap(name="wrap", wrap_object="line"))
    model.add(PathActuator(name="cable", geometry_path=path, optimal_force=3.0))
    mjcf, result = errors(model)
    assert np.abs(result["cable"]).max() < 1e-9
    compiled = mujoco.MjModel.from_xml_string(mjcf.text)
    assert compiled.ntendon == compiled.nu == 1 and compiled.actuator_gear[0, 0] == -3.0
