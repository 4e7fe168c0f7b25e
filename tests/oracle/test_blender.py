"""Compare poses in a live Blender with the model, after export to BVH and glTF.

Bones of BVH files and objects of glTF files must be where the model has its bodies. The variable
OSIMLITE_BLENDER names a Python 3.11 that has Blender (``pip install bpy``).
"""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import write_sto
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.models.jumper import jumper
from osimlite.schema.model import Model
from tests.cli.command import run
from tests.io.b3d_files import make_walker

pytestmark = pytest.mark.full

VARIABLE = "OSIMLITE_BLENDER"

SCRIPT = """
import json, os, sys
import bpy

path, times = json.load(sys.stdin)
# Blender prints its progress on the standard output.
answer_stream, _ = os.dup(1), os.dup2(2, 1)
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene

def rows(matrix):
    return [list(row) for row in matrix]

result = []
if path.endswith(".bvh"):
    bpy.ops.import_anim.bvh(filepath=path, global_scale=0.01, frame_start=1)
    (armature,) = (each for each in scene.objects if each.type == "ARMATURE")
    # A bone of Blender points along itself: its turn is that from its pose at rest.
    rest = {bone.name: armature.matrix_world @ bone.matrix_local for bone in armature.data.bones}
    for frame in range(len(times)):
        scene.frame_set(1 + frame)
        poses = {}
        for bone in armature.pose.bones:
            pose = (armature.matrix_world @ bone.matrix) @ rest[bone.name].to_3x3().inverted().to_4x4()
            poses[bone.name] = rows(pose)
        result.append(poses)
else:
    bpy.ops.import_scene.gltf(filepath=path)
    for time in times:
        frame = time * scene.render.fps / scene.render.fps_base
        scene.frame_set(int(frame), subframe=frame - int(frame))
        graph = bpy.context.evaluated_depsgraph_get()
        result.append({each.name: rows(each.evaluated_get(graph).matrix_world) for each in scene.objects})
os.write(answer_stream, b"\\nANSWER" + json.dumps([bpy.app.version_string, result]).encode() + b"\\n")
"""

UPRIGHT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Rotation from OpenSim's axes (Y up) to Blender's axes (Z up)."""

CLOSE = 2e-6
"""Largest difference of positions (m) and of entries of rotation matrices; Blender has single precision."""


def ask_blender(path: Path, times: list[float]) -> list[dict[str, Any]]:
    """Return for each time the poses (4, 4) of all bones or objects in Blender, by name."""
    python = os.environ.get(VARIABLE)
    if not python:
        pytest.skip(f"needs Blender: {VARIABLE} names no Python that has bpy")
    done = subprocess.run(
        [python, "-c", SCRIPT],
        input=json.dumps([str(path), times]),
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
        timeout=240,
        env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
    )
    for line in done.stdout.splitlines():
        if line.startswith("ANSWER"):
            result: list[dict[str, Any]] = json.loads(line.removeprefix("ANSWER"))[1]
            return result
    raise AssertionError(f"Blender ended with {done.returncode}: {done.stderr[-500:]}")


def measure(
    mechanism: Mechanism, values: Any, result: list[dict[str, Any]], at_joint: bool
) -> tuple[float, float]:
    """Return the largest differences between Blender's poses and the bodies of a mechanism.

    Args:
        mechanism: mechanism of the model.
        values: coordinates (frames, n).
        result: Blender's poses.
        at_joint: whether a pose is at the centre of the joint of a body, not at the origin of the
            body.

    Returns:
        The largest difference of positions (m) and that of entries of rotation matrices.
    """
    position_error = rotation_error = 0.0
    for q, poses in zip(values, result, strict=True):
        state = mechanism.at(q)
        for index, body in enumerate(mechanism.bodies):
            pose = np.array(poses[body.name.rpartition("/")[2]])
            center = body.mobilizer.child_frame[:3, 3] if at_joint else np.zeros(3)
            position = UPRIGHT @ state.point(index, center)
            rotation = UPRIGHT @ state.rotations[index] @ UPRIGHT.T
            position_error = max(position_error, float(np.abs(pose[:3, 3] - position).max()))
            rotation_error = max(rotation_error, float(np.abs(pose[:3, :3] - rotation).max()))
    return position_error, rotation_error


def make_motion(mechanism: Mechanism, file: Path) -> tuple[Any, Any]:
    """Write a smooth motion of all coordinates.

    Returns:
        The times (frames,) in s, and the coordinates (frames, n).
    """
    # The glTF exporter writes 60 poses per second.
    times = np.arange(31) / 60.0
    phases = 1.7 * np.arange(len(mechanism.coordinates))
    values = np.array(
        [
            mechanism.assemble(
                dict(
                    zip(
                        mechanism.coordinate_names,
                        mechanism.values({}) + 0.3 * np.sin(phases + 5.0 * time),
                        strict=True,
                    )
                )
            )
            for time in times
        ]
    )
    write_sto(file, "motion", times, tuple(mechanism.coordinate_names), values)
    return times, values


def compare(model: Model, suffix: str, folder: Path) -> tuple[float, float]:
    """Export a model with a motion and compare it in Blender.

    Returns:
        The largest differences of `measure`.
    """
    osimlite.write(model, folder / "it.osim")
    mechanism = osimlite.mechanism(model)
    times, values = make_motion(mechanism, folder / "motion.sto")
    done = run("convert", "it.osim", "--motion", "motion.sto", "-o", f"it.{suffix}", folder=folder)
    assert done.code == 0, done.err
    result = ask_blender(folder / f"it.{suffix}", [float(time) for time in times])
    return measure(mechanism, values, result, suffix == "bvh")


@pytest.mark.parametrize("suffix", ["bvh", "glb"])
@pytest.mark.parametrize("make", [dynamic_walker, jumper, make_walker])
def test_blender_has_the_poses_of_the_model(
    tmp_path: Path, make: Callable[[], Model], suffix: str
) -> None:
    assert max(compare(make(), suffix, tmp_path)) < CLOSE
