"""Collision shapes of a robot from the contact geometry of a model."""

from __future__ import annotations

import numpy as np

from osimlite.errors import ModelError
from osimlite.io.meshes.unit_shapes import make_ball
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array, make_offset
from osimlite.schema.contact import ContactGeometry
from osimlite.schema.contact_types import (
    ContactEllipsoid,
    ContactHalfSpace,
    ContactMesh,
    ContactSphere,
)
from osimlite.schema.model import Model
from osimlite.simulation.robot.mesh_files import MeshFiles
from osimlite.simulation.robot.robot import Ball, Box, MeshFile, Shape, Visual
from osimlite.simulation.robot.visuals import mesh_shape
from osimlite.translate.fidelity import Fidelity

HALF_SPACE_BOX_M = (1.0, 200.0, 200.0)
"""Size (m) of the box that replaces a half space: thickness, and edges along the surface.

URDF has no infinite plane; 200 m are more than any motion covers.
"""


def collect_collisions(
    model: Model, mechanism: Mechanism, fidelity: Fidelity, mesh_files: MeshFiles
) -> dict[str, list[Visual]]:
    """Collect the contact surfaces of a model as collision shapes.

    Args:
        model: model with contact geometry.
        mechanism: mechanism of the model, which locates frames.
        fidelity: account to which losses are added.
        mesh_files: collection of mesh files, which finds and adds them.

    Returns:
        Shapes, placed in the frame of their body, by the absolute path of the body (or "/ground").
    """
    tree = model.tree()
    result = dict[str, list[Visual]]()
    for geometry in tree.components:
        if not isinstance(geometry, ContactGeometry):
            continue
        path = tree.path_of(geometry) or geometry.name
        try:
            frame = tree.path_of(tree.target(geometry, "socket_frame", geometry.socket_frame))
        except ModelError:
            frame = None
        # A frame that is missing or not fixed to a body has no place in a link.
        if frame is None or frame not in mechanism.frames:
            fidelity.add(
                "contact-geometry",
                path,
                "a contact surface in a frame that is not fixed to a body",
                "left out",
            )
            continue
        shape_and_frame = _make_shape(geometry, path, fidelity, mesh_files)
        if shape_and_frame is None:
            continue
        shape, local_frame = shape_and_frame
        body, frame_in_body = mechanism.frames[frame]
        owner = "/ground" if body < 0 else mechanism.bodies[body].path
        origin = frame_in_body @ make_offset(geometry.location, geometry.orientation) @ local_frame
        result.setdefault(owner, []).append(Visual(shape, origin, source=path))
    return result


def _make_shape(
    geometry: ContactGeometry, path: str, fidelity: Fidelity, mesh_files: MeshFiles
) -> tuple[Shape, Array] | None:
    """Return the shape of a contact surface and its frame in the frame of the geometry, or None."""
    local_frame = np.eye(4)

    def report(what: str, done: str, detail: str = "") -> None:
        fidelity.add("contact-geometry", path, what, done, detail)

    match geometry:
        case ContactSphere() if geometry.radius > 0.0:
            report(
                "the material of a contact surface",
                "a collision shape without the material",
                f"sphere of {geometry.radius:g} m",
            )
            return Ball(geometry.radius), local_frame
        case ContactHalfSpace():
            # OpenSim's half space fills x > 0, so that the box lies on that side of its face.
            local_frame[0, 3] = HALF_SPACE_BOX_M[0] / 2.0
            size = " x ".join(f"{edge:g}" for edge in HALF_SPACE_BOX_M)
            report(
                "a half space, and its material",
                f"a collision box of {size} m, one face of which is the surface",
            )
            return Box(HALF_SPACE_BOX_M), local_frame
        # URDF has no ellipsoids, so that a scaled ball becomes a mesh file.
        case ContactEllipsoid() if min(geometry.radii) > 0.0:
            file = mesh_files.name_of_stretched("ellipsoid", make_ball(), geometry.radii)
            report("an ellipsoid, and its material", "a collision shape in a mesh file", file)
            return MeshFile(file), local_frame
        case ContactMesh():
            shape = mesh_shape(geometry.filename, path, mesh_files, fidelity.add)
            if shape is not None:
                done = "a collision shape of the file; many programs take its convex hull"
                report("the material of a contact mesh", done, shape.file)
                return shape, local_frame
            return None
    report(f"a contact surface of class {type(geometry).__name__}", "left out")
    return None
