from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from osimlite import Body, Coordinate, Model, SliderJoint
from osimlite.errors import OsimliteError
from osimlite.io.meshes import unit_shapes
from osimlite.io.meshes.folders import MeshFolders, read_surface
from osimlite.mechanics.multibody import build_mechanism
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.schema.geometry import Mesh
from osimlite.schema.geometry_types import Brick, Cylinder, LineGeometry, Sphere, Torus
from osimlite.schema.wrap_types import WrapTorus
from osimlite.view.collect import build_scene


def scene_of(model, folders=None):
    mechanism = build_mechanism(model)
    return build_scene(model, mechanism, folders), mechanism


def with_shape(shape, folders=None):
    """Build the walker with a single shape on its pelvis.

    Args:
        shape: the shape.
        folders: folders of meshes.

    Returns:
        Scene, and the points of the shape in the frame of the body; None if the shape is not drawn.
    """
    model = dynamic_walker()
    pelvis = model.body_set.objects[1]
    del pelvis.attached_geometry[:]
    pelvis.attach(shape)
    scene, mechanism = scene_of(model, folders)
    result = [item for item in scene.items if item.path.startswith("/bodyset/Pelvis/")]
    if not result:
        return scene, None
    (item,) = result
    assert mechanism.bodies[item.body].name == "Pelvis"
    return scene, scene.surfaces[item.surface].points @ item.matrix[:3, :3].T + item.matrix[:3, 3]


@pytest.mark.parametrize(
    ("make", "volume"),
    [
        (unit_shapes.make_ball, 4.0 / 3.0 * np.pi),
        (lambda: unit_shapes.make_ball(8, 4), 4.0 / 3.0 * np.pi),
        (unit_shapes.make_cylinder, np.pi),
        (unit_shapes.make_cone, np.pi / 3.0),
        (lambda: unit_shapes.make_torus(0.3), 2.0 * np.pi**2 * 0.09),
        (unit_shapes.make_cube, 1.0),
    ],
)
def test_unit_shapes_are_closed_and_turned_outwards(make, volume):
    shape = make()
    a, b, c = (shape.points[shape.triangles[:, index]] for index in range(3))
    areas = np.cross(b - a, c - a)
    enclosed = np.einsum("ij,ij->", a, areas) / 6.0
    assert volume * (0.7 if len(shape.points) < 100 else 0.95) < enclosed <= volume * (1.0 + 1e-12)
    assert np.linalg.norm(areas.sum(axis=0)) < 1e-12
    assert (np.einsum("ij,ij->i", areas, shape.normals[shape.triangles].sum(axis=1)) > -1e-12).all()
    assert np.linalg.norm(shape.normals, axis=1) == pytest.approx(1.0)


def test_a_cylinder_stands_along_y():
    _, points = with_shape(Cylinder(radius=0.1, half_height=0.3))
    assert np.ptp(points, axis=0) == pytest.approx((0.2, 0.6, 0.2), abs=1e-9)


def test_shapes_have_their_size_times_their_scale():
    _, points = with_shape(Brick(half_lengths=(0.1, 0.2, 0.3), scale_factors=(1.0, 2.0, 3.0)))
    assert np.ptp(points, axis=0) == pytest.approx((0.2, 0.8, 1.8))
    _, points = with_shape(Sphere(radius=0.5, scale_factors=(1.0, 1.0, -2.0)))
    assert np.ptp(points, axis=0) == pytest.approx((1.0, 1.0, 2.0))


def test_meshes_are_read_from_files_of_every_kind(repo: Path):
    folder = repo / "fixtures" / "meshes"
    kinds = set()
    for path in sorted(folder.rglob("*")):
        if path.suffix.lower() in (".vtp", ".stl", ".obj"):
            try:
                surface = read_surface(path)
            except OsimliteError:
                continue
            kinds.add(path.suffix.lower())
            assert surface.triangles.max() < len(surface.points)
            assert np.linalg.norm(unit_shapes.compute_normals(surface), axis=1).max() < 1.0 + 1e-5
    assert ".vtp" in kinds


def test_a_mesh_is_found_scaled_and_shared(tmp_path: Path):
    (tmp_path / "corner.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 3 4\n")
    scene, points = with_shape(
        Mesh(mesh_file="corner.obj", scale_factors=(2.0, 1.0, -1.0)), MeshFolders(tmp_path)
    )
    assert points.min(axis=0).tolist() == [0.0, 0.0, -1.0] and points.max(axis=0).tolist() == [
        2.0,
        1.0,
        0.0,
    ]
    assert not scene.remarks


def test_what_cannot_be_drawn_is_said_and_the_body_becomes_a_stick(tmp_path):
    scene, points = with_shape(Mesh(mesh_file="nowhere.vtp"))
    assert points is None
    ((path, said),) = scene.remarks
    assert (
        path == "/bodyset/Pelvis/Pelvis_geom_1" and "nowhere.vtp" in said and "--geometry" in said
    )
    assert [line.path for line in scene.lines] == ["/bodyset/Pelvis"] * 2
    corner = tmp_path / "corner.obj"
    corner.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    scene, points = with_shape(Mesh(mesh_file=str(corner)), MeshFolders(tmp_path / "inner"))
    assert points is None and "outside the model's folder" in scene.remarks[0][1]
    scene, points = with_shape(Torus())
    assert points is None and "Torus" in scene.remarks[0][1]


def test_a_hidden_shape_is_kept_but_not_drawn():
    shape = Sphere(radius=0.1)
    shape.appearance.visible = False
    scene, _ = with_shape(shape)
    assert [item.visible for item in scene.items if "Pelvis_geom" in item.path] == [False]
    assert not [item for item in scene.iterate_visible_items() if "Pelvis_geom" in item.path]


def test_a_line_is_a_line():
    scene, _ = with_shape(LineGeometry(start_point=(0.0, 0.0, 0.0), end_point=(1.0, 2.0, 3.0)))
    line = next(line for line in scene.lines if "Pelvis_geom" in line.path)
    assert line.route[1].location.tolist() == [1.0, 2.0, 3.0]


def test_contact_surfaces_are_where_the_forces_find_them():
    scene, mechanism = scene_of(dynamic_walker())
    spheres = [
        item
        for item in scene.items
        if item.layer == "contact" and item.path not in scene.half_spaces
    ]
    assert len(spheres) == 6 and len(scene.half_spaces) == 1 and len(scene.force_anchors) == 6
    foot = next(push for push in scene.force_anchors if push.element == "LFootForce")
    assert foot.labels[:2] == ("LeftShank", "LeftShank") and foot.near.tolist() == [
        0.0,
        -0.2175,
        0.0,
    ]
    drawn = next(item for item in spheres if item.path == foot.surface)
    assert drawn.matrix[:3, 3].tolist() == [0.0, -0.2175, 0.0] and drawn.matrix[0, 0] == 0.05
    (ground,) = [item for item in scene.items if item.path in scene.half_spaces]
    assert mechanism.bodies[ground.body].name == "Platform"
    normal = -ground.matrix[:3, 0] / np.linalg.norm(ground.matrix[:3, 0])
    assert np.abs(normal - (0.0, 1.0, 0.0)).max() < 1e-3


def test_a_torus_to_wrap_around_is_where_paths_touch_it():
    """In OpenSim 4.6, the tube around which a path wraps has `inner_radius`, and its circle has `outer_radius`."""
    model = dynamic_walker()
    model.body_set.objects[1].wrap_object_set.objects.append(
        WrapTorus(name="ring", inner_radius=0.01, outer_radius=0.05)
    )
    scene, _ = scene_of(model)
    (item,) = (item for item in scene.items if item.path.endswith("/ring"))
    x, y, z = (scene.surfaces[item.surface].points @ item.matrix[:3, :3].T).T
    assert np.hypot(x, y).max() == pytest.approx(0.06)
    assert np.hypot(x, y).min() == pytest.approx(0.04)
    assert np.abs(z).max() == pytest.approx(0.01)


def test_scenery_does_not_count_for_the_size_of_a_model():
    scene, mechanism = scene_of(dynamic_walker())
    low, high = scene.compute_box(mechanism.default_state()[0])
    assert {scene.items[place].path.rsplit("/", 1)[1] for place in scene.large} >= {
        "PlatformContact"
    }
    assert (high - low).max() < 2.0


def test_sticks_join_the_joints():
    model = dynamic_walker()
    for body in model.body_set.objects:
        del body.attached_geometry[:]
    scene, mechanism = scene_of(model)
    q = mechanism.values({})
    pose = scene.compute_poses(q)
    lines = {
        line.path.rsplit("/", 1)[1]: corners
        for line, corners in zip(scene.lines, pose.lines, strict=True)
    }
    thigh, shank = lines["RightThigh"], lines["RightShank"]
    assert np.linalg.norm(thigh[1] - thigh[0]) == pytest.approx(0.4)
    # The last body of a limb has no further joint, so its stick ends at its mass centre.
    assert np.linalg.norm(shank[1] - shank[0]) == pytest.approx(0.2175)
    assert shank[0] == pytest.approx(thigh[1])


def test_sticks_go_where_a_joint_moves_what_it_carries():
    model = Model(name="knee")
    carrier = model.ground
    for name in ("femur", "tibia"):
        body = model.add(Body(name=name, mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
        model.add(
            SliderJoint(name=f"{name}_slides", coordinates=[Coordinate(name=name)]).between(
                carrier, body
            )
        )
        carrier = body
    scene, mechanism = scene_of(model)
    q = mechanism.values({"femur": 0.5, "tibia": -0.4})
    (femur,) = (k for k, line in enumerate(scene.lines) if line.path == "/bodyset/femur")
    assert scene.compute_poses(q).lines[femur] == pytest.approx(
        np.array([(0.5, 0.0, 0.0), (0.1, 0.0, 0.0)])
    )
