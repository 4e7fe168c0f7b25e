"""Tests of recordings for Rerun, which Rerun itself reads back."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from osimlite.errors import MissingDependency
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.view import ModelView
from osimlite.view.drawn_forces import DrawnForces
from tests.view.motions import stroll


def read(path: Path) -> dict[str, dict[str, Any]]:
    """Read a recording with Rerun.

    Returns:
        By entity and component, a row for each time.
    """
    chunk = pytest.importorskip("rerun.chunk", reason="needs rerun-sdk (extra 'rerun')")
    result: dict[str, dict[str, Any]] = {}
    for part in chunk.RrdReader(path).stream().to_chunks():
        result.setdefault(part.entity_path, {}).update(part.to_record_batch().to_pydict())
    return result


def test_bodies_and_forces_are_where_the_scene_has_them(tmp_path: Path):
    motion = stroll(11)
    shown = ModelView.from_model(dynamic_walker(), motion=motion)
    scene = shown.scene
    result = read(shown.write_rrd(tmp_path / "walk.rrd"))
    poses = [scene.compute_poses(row) for row in motion.values]
    for index, body in enumerate(scene.mechanism.bodies):
        moves = result[f"/model{body.path}"]
        for moment, pose in enumerate(poses):
            # Rerun stores matrices by columns.
            turned = np.array(moves["Transform3D:mat3x3"][moment]).reshape(3, 3).T
            assert np.allclose(turned, pose.rotations[index], atol=1e-6)
            assert np.allclose(
                moves["Transform3D:translation"][moment], pose.origins[index], atol=1e-6
            )
    assert [time.total_seconds() for time in moves["time"]] == pytest.approx(motion.times)
    (push,) = [
        item
        for item in DrawnForces.from_motion(scene, motion, motion.times).forces
        if item.anchor.element == "RFootForce"
    ]
    arrows = result["/model/forces/forceset/RFootForce/RightShank"]
    assert np.allclose(
        arrows["Arrows3D:origins"],
        [[push.locate_point(k, pose)] for k, pose in enumerate(poses)],
        atol=1e-6,
    )
    size = result["/forces/forceset/RFootForce/RightShank"]["Scalars:scalars"]
    assert np.allclose(np.ravel(size), np.linalg.norm(push.forces, axis=1))
    assert np.allclose(
        np.ravel(result["/coordinates/Pelvis_tx"]["Scalars:scalars"]), motion.values[:, 2]
    )
    items = [item for item in scene.iterate_visible_items() if item.body >= 0]
    meshes = {name for name, parts in result.items() if "Mesh3D:vertex_positions" in parts}
    assert {
        f"/model{scene.mechanism.bodies[item.body].path}{item.path}" for item in items
    } <= meshes


def test_without_rerun_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(MissingDependency, match=r"osimlite\[rerun\]"):
        ModelView.from_model(dynamic_walker()).write_rrd(tmp_path / "walk.rrd")
