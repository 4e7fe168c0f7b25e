"""Tests of URDF files with meshes: another program reads them, and their shapes are compared with the scene."""

from __future__ import annotations

import numpy as np
import pytest

from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.geometry import Mesh
from osimlite.schema.geometry_types import Brick, Cylinder
from osimlite.translate.export import to_urdf
from osimlite.view import ModelView


def test_every_shape_is_where_the_scene_has_it(fixtures, tmp_path):
    yourdfpy = pytest.importorskip("yourdfpy", reason="needs yourdfpy (extra 'dev')")
    model = dynamic_walker()
    shank = model.body_set.objects[-1]
    shank.attach(
        Cylinder(radius=0.03, half_height=0.11),
        Brick(half_lengths=(0.1, 0.02, 0.03), scale_factors=(1.0, 2.0, 0.5)),
        Mesh(mesh_file="binary.vtp", scale_factors=(0.1, 0.2, -0.3)),
    )
    shank.attached_geometry[-1].appearance.color = (0.2, 0.4, 0.6)
    folders = [fixtures / "meshes"]
    view = ModelView.from_model(model, folders=folders)
    urdf = to_urdf(model, geometry=folders)
    urdf.write(tmp_path)
    robot = yourdfpy.URDF.load(str(next(tmp_path.glob("*.urdf"))))
    values = urdf.robot.joint_values(view.q)
    robot.update_cfg({name: values[name] for name in robot.actuated_joint_names})
    theirs = []
    for node in robot.scene.graph.nodes_geometry:
        place, name = robot.scene.graph[node]
        points = robot.scene.geometry[name].vertices @ place[:3, :3].T + place[:3, 3]
        theirs.append((points.min(axis=0), points.max(axis=0)))
    bodies = view.scene.compute_poses(view.q)
    ours = []
    for item in view.scene.iterate_visible_items():
        if item.layer == "geometry":
            points = (
                view.scene.surfaces[item.surface].points @ item.matrix[:3, :3].T
                + item.matrix[:3, 3]
            )
            points = bodies.transform_points(item.body, points)
            ours.append((points.min(axis=0), points.max(axis=0)))
    assert len(ours) == len(theirs) == 9
    # The programs cut round shapes into different triangles, so their extents differ by up to 1 %.
    for low, high in ours:
        away = [
            max(np.abs(low - a).max(), np.abs(high - b).max()) / np.linalg.norm(high - low)
            for a, b in theirs
        ]
        assert min(away) < 0.01
    assert [0.2, 0.4, 0.6, 1.0] in [
        material.color.rgba.tolist() for material in robot.robot.materials
    ]
