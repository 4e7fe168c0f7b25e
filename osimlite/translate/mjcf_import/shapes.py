"""Appearance of bodies: geoms as shapes, meshes as files beside the model."""

from __future__ import annotations

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.frames import PhysicalFrame
from osimlite.schema.geometry import Appearance, Geometry, Mesh
from osimlite.schema.geometry_types import Brick, Cylinder, Ellipsoid, Sphere
from osimlite.translate.fidelity import LEFT_OUT
from osimlite.translate.mjcf_import.draft import ConversionDraft, quaternion_matrix

PLANE = 0
"""MuJoCo's ``mjGEOM_PLANE``."""

HFIELD = 1
"""MuJoCo's ``mjGEOM_HFIELD``."""

SPHERE = 2
"""MuJoCo's ``mjGEOM_SPHERE``."""

CAPSULE = 3
"""MuJoCo's ``mjGEOM_CAPSULE``."""

ELLIPSOID = 4
"""MuJoCo's ``mjGEOM_ELLIPSOID``."""

CYLINDER = 5
"""MuJoCo's ``mjGEOM_CYLINDER``."""

BOX = 6
"""MuJoCo's ``mjGEOM_BOX``."""

MESH = 7
"""MuJoCo's ``mjGEOM_MESH``."""

SDF = 8
"""MuJoCo's ``mjGEOM_SDF``."""
GEOMETRY_FOLDER = "Geometry"
"""Folder of mesh files; OpenSim looks for meshes there."""

Z_TO_Y = np.array(((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)))
"""Axes of a cylinder along Y (OpenSim's), in the frame of one along Z (MuJoCo's)."""


class _Part(NamedTuple):
    shape: Geometry
    position: Array  # position in the frame of the geom, m
    rotation: Array


def add_shapes(draft: ConversionDraft) -> None:
    """Add geoms as shapes of their bodies, but for those that tendons wrap around."""
    model = draft.mj
    for geom in range(model.ngeom):
        if geom in draft.wrapping_geoms:
            continue
        parts = _make_parts(draft, geom)
        if parts is None:
            continue
        name = draft.source.name_of("geom", geom)
        body = int(model.geom_bodyid[geom])
        rotation = quaternion_matrix(model.geom_quat[geom])
        position = model.geom_pos[geom]
        for part in parts:
            frame, _ = draft.frame_at(
                body,
                f"{name}_frame",
                position + rotation @ part.position,
                rotation @ part.rotation,
            )
            _draw(draft, geom, frame, part.shape, name)
        draft.note_result("geom", geom, f"shape {name}")


def _draw(
    draft: ConversionDraft, geom: int, frame: PhysicalFrame, shape: Geometry, name: str
) -> None:
    model = draft.mj
    rgba = model.geom_rgba[geom]
    material = int(model.geom_matid[geom])
    # MuJoCo's default colour means that the material decides.
    if material >= 0 and np.allclose(rgba, (0.5, 0.5, 0.5, 1.0)):
        rgba = model.mat_rgba[material]
    red, green, blue, opacity = (float(min(max(value, 0.0), 1.0)) for value in rgba)
    # MuJoCo's viewers show only groups 0 to 2 by default.
    shape.appearance = Appearance(
        name="appearance",
        visible=bool(model.geom_group[geom] < 3),
        opacity=opacity,
        color=(red, green, blue),
    )
    shape.name = draft.unique("shape", name)
    frame.attach(shape)


def _make_parts(draft: ConversionDraft, geom: int) -> list[_Part] | None:
    """Return the shapes of a geom; None if it has none, which is recorded."""
    model = draft.mj
    size = [float(value) for value in model.geom_size[geom]]
    geom_type = int(model.geom_type[geom])
    origin, identity = np.zeros(3), np.eye(3)
    if geom_type == SPHERE:
        return [_Part(Sphere(radius=size[0]), origin, identity)]
    if geom_type == ELLIPSOID:
        return [_Part(Ellipsoid(radii=(size[0], size[1], size[2])), origin, identity)]
    if geom_type == BOX:
        return [_Part(Brick(half_lengths=(size[0], size[1], size[2])), origin, identity)]
    if geom_type in (CYLINDER, CAPSULE):
        parts = [_Part(Cylinder(radius=size[0], half_height=size[1]), origin, Z_TO_Y)]
        if geom_type == CAPSULE:
            for end in (-size[1], size[1]):
                parts.append(_Part(Sphere(radius=size[0]), np.array((0.0, 0.0, end)), identity))
        return parts
    if geom_type in (MESH, SDF) and int(model.geom_dataid[geom]) >= 0:
        file = write_mesh(draft, int(model.geom_dataid[geom]))
        return [_Part(Mesh(mesh_file=file.rpartition("/")[2]), origin, identity)]
    if geom_type == PLANE:
        # A plane is endless; contact surfaces show it.
        draft.note_result("geom", geom, "not drawn: a plane")
        return None
    draft.drop("geom", geom, "a height field or another shape that OpenSim does not have")
    return None


def write_mesh(draft: ConversionDraft, mesh: int) -> str:
    """Add the file of a mesh to the draft, once.

    MuJoCo moves a mesh to its mass centre and principal axes when it compiles; the file has the
    points as they are then, which the poses of geoms refer to.

    Returns:
        Name of the file relative to the model.
    """
    model = draft.mj
    if mesh not in draft.meshes:
        name = draft.unique("mesh", draft.source.name_of("mesh", mesh))
        file = draft.meshes[mesh] = f"{GEOMETRY_FOLDER}/{name}.obj"
        first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        vertices = model.mesh_vert[first : first + count]
        first, count = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
        # Indices of OBJ files begin with 1.
        faces = model.mesh_face[first : first + count] + 1
        lines = [f"v {x:.8g} {y:.8g} {z:.8g}" for x, y, z in vertices.tolist()]
        lines += [f"f {a} {b} {c}" for a, b, c in faces.tolist()]
        draft.files[file] = "\n".join(lines) + "\n"
        draft.note_result("mesh", mesh, f"file {file}")
    return draft.meshes[mesh]


def record_unseen(draft: ConversionDraft) -> None:
    """Record what a viewer of MuJoCo shows, or a program reads, and OpenSim does not have."""
    model = draft.mj
    for kind, count, description in (
        ("camera", model.ncam, "a camera"),
        ("light", model.nlight, "a light"),
        ("sensor", model.nsensor, "a sensor"),
        ("skin", model.nskin, "a skin"),
        ("flex", model.nflex, "a deformable body"),
        ("hfield", model.nhfield, "a height field"),
        ("texture", model.ntex, "a texture"),
        ("plugin", model.nplugin, "a plugin"),
        ("numeric", model.nnumeric, "numbers for programs"),
        ("text", model.ntext, "text for programs"),
        ("tuple", model.ntuple, "a tuple for programs"),
    ):
        for index in range(int(count)):
            draft.drop(kind, index, description)
    option = model.opt
    for description, value in (
        ("wind", option.wind),
        ("the density of a fluid", option.density),
        ("the viscosity of a fluid", option.viscosity),
    ):
        if np.any(value):
            draft.fidelity.add("option", "/option", description, LEFT_OUT, f"{value}")
