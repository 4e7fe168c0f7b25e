"""Contact surfaces as geoms, and contact forces as pairs of geoms with MuJoCo's own law."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from osimlite.base.text import add_article
from osimlite.errors import ModelError
from osimlite.mechanics.multibody.spatial import Array, make_offset
from osimlite.schema.contact import ContactGeometry
from osimlite.schema.contact_forces import ElasticFoundationForce, SmoothSphereHalfSpaceForce
from osimlite.schema.contact_types import (
    ContactEllipsoid,
    ContactHalfSpace,
    ContactMesh,
    ContactSphere,
)
from osimlite.schema.forces import Force, HuntCrossleyForce
from osimlite.schema.tree import Use
from osimlite.simulation.robot.visuals import mesh_shape
from osimlite.translate.collisions import HALF_SPACE_BOX_M
from osimlite.translate.fidelity import LEFT_OUT
from osimlite.translate.mjcf.draft import MjcfDraft, Untranslatable, Value, add_element, format_pose
from osimlite.translate.mjcf.scenery import CONTACT_GROUP

_PLANE = np.array(
    ((0.0, 0.0, -1.0, 0.0), (0.0, 1.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
)
"""Frame (4, 4) of a MuJoCo plane, whose outward normal is z, in the frame of an OpenSim half
space, whose outward normal is -x.
"""

ContactForce = HuntCrossleyForce | ElasticFoundationForce | SmoothSphereHalfSpaceForce
"""Contact forces that become pairs of geoms."""


MIN_RELATIVE_THICKNESS = 1e-12
"""Least thickness of a contact mesh, over its largest coordinate: MuJoCo finds no convex hull of a
flat one, and rounding limits what it calls flat.
"""


def add_contacts(draft: MjcfDraft) -> None:
    """Add contact surfaces, and a pair for any two surfaces that a contact force connects."""
    surfaces = list(draft.iterate_components(ContactGeometry))
    if draft.options.contact == "none" or not surfaces:
        return
    contact_default = add_element(draft.get_section("default"), "default", class_="touches")
    add_element(
        contact_default,
        "geom",
        contype=0,
        conaffinity=0,
        group=CONTACT_GROUP,
        mass=0,
        rgba=(0.4, 0.7, 0.7, 0.4),
    )
    for geometry, path in surfaces:
        try:
            _add_surface(draft, geometry, path)
        except (ModelError, Untranslatable) as error:
            description = add_article(type(geometry).__name__)
            draft.fidelity.add("contact-geometry", path, description, f"{LEFT_OUT}: {error}")
    for force, path in draft.iterate_components(Force):
        if not isinstance(force, ContactForce) or not force.appliesForce:
            continue
        description = f"the contact law of {add_article(type(force).__name__)}"
        try:
            pair_names = " ".join(_add_pairs(draft, force))
        except ModelError as error:
            draft.fidelity.add("contact", path, description, f"{LEFT_OUT}: {error}")
            continue
        if not pair_names:
            is_stiff = all(stiffness > 0.0 for *_, stiffness in _iterate_surfaces(draft, force))
            reason = (
                "no two of its surfaces on different bodies are in the file"
                if is_stiff
                else "a stiffness of its surfaces is not positive"
            )
            draft.fidelity.add("contact", path, description, f"{LEFT_OUT}: {reason}")
            continue
        replacement = "MuJoCo's contact law: it supports the bodies, but forces and motions differ"
        draft.fidelity.add("contact", path, description, replacement, f"pairs {pair_names}")


def _add_surface(draft: MjcfDraft, geometry: ContactGeometry, path: str) -> None:
    """Add the geom of a contact geometry, if MuJoCo has one for it."""
    body, frame_in_body = draft.find_placement(geometry, "socket_frame")
    geom_and_frame = _make_geom(
        draft,
        geometry,
        path,
        is_static=not draft.bodies[body].xpath("ancestor-or-self::body/joint"),
    )
    if geom_and_frame is None:
        return
    attributes, local_frame = geom_and_frame
    name = draft.make_name("geom", path)
    frame = frame_in_body @ make_offset(geometry.location, geometry.orientation) @ local_frame
    add_element(
        draft.bodies[body], "geom", class_="touches", name=name, **attributes, **format_pose(frame)
    )
    draft.fidelity.translated[path] = f"geom {name}"


def _make_geom(
    draft: MjcfDraft, geometry: ContactGeometry, path: str, *, is_static: bool
) -> tuple[dict[str, Value], Array] | None:
    """Return the attributes of a geom and its frame (4, 4) in that of the geometry.

    A mesh without a file gives None.

    Raises:
        Untranslatable: MuJoCo has no such surface, or a radius is not positive.
    """
    match geometry:
        case ContactSphere() if geometry.radius > 0.0:
            return {"type": "sphere", "size": [geometry.radius]}, np.eye(4)
        case ContactEllipsoid() if min(geometry.radii) > 0.0:
            return {"type": "ellipsoid", "size": geometry.radii}, np.eye(4)
        # MuJoCo allows planes on static bodies only.
        case ContactHalfSpace() if is_static:
            return {"type": "plane", "size": (0.0, 0.0, 1.0)}, _PLANE
        case ContactHalfSpace():
            box_frame = make_offset((HALF_SPACE_BOX_M[0] / 2.0, 0.0, 0.0), (0.0, 0.0, 0.0))
            size = " x ".join(f"{edge:g}" for edge in HALF_SPACE_BOX_M)
            replacement = f"a box of {size} m, one face of which is the surface"
            draft.fidelity.add(
                "contact-geometry", path, "a half space on a body that moves", replacement
            )
            return {"type": "box", "size": [edge / 2.0 for edge in HALF_SPACE_BOX_M]}, box_frame
        case ContactMesh():
            shape = mesh_shape(geometry.filename, path, draft.mesh_files, draft.fidelity.add)
            if shape is None:
                return None
            _require_thickness(draft.mesh_files.corners[shape.file])
            mesh = draft.add_mesh(shape.file, shape.scale)
            draft.fidelity.add(
                "contact-geometry", path, "a contact mesh", "its convex hull", shape.file
            )
            return {"type": "mesh", "mesh": mesh}, np.eye(4)
    raise Untranslatable("MuJoCo has no such surface")


def _require_thickness(corners: Array) -> None:
    """Check that a contact mesh has a convex hull.

    Args:
        corners: corners (t, 3, 3) of its triangles, m.

    Raises:
        Untranslatable: all corners are in one plane.
    """
    points = corners.reshape(-1, 3)
    centered_points = points - points.mean(axis=0)
    thickness = float(np.linalg.svd(centered_points, compute_uv=False)[-1])
    if thickness <= MIN_RELATIVE_THICKNESS * float(np.abs(points).max()):
        raise Untranslatable("its corners are in one plane, so that it has no convex hull")


def _add_pairs(draft: MjcfDraft, force: ContactForce) -> Iterator[str]:
    """Add a pair for any two surfaces of a force that are stiff and on different bodies.

    Yields:
        Name of each pair.
    """
    # Surfaces in series: one that is infinitely soft takes the force from both. In an elastic
    # foundation each mesh has springs of its own.
    find_stiffness = max if isinstance(force, ElasticFoundationForce) else min
    for (first_surface, first_friction, first_stiffness), (
        second_surface,
        second_friction,
        second_stiffness,
    ) in combinations(_iterate_surfaces(draft, force), 2):
        geom_records = [
            draft.fidelity.translated.get(draft.tree.path_of(surface) or "")
            for surface in (first_surface, second_surface)
        ]
        bodies = [
            draft.find_placement(surface, "socket_frame").body
            for surface in (first_surface, second_surface)
        ]
        are_half_spaces = isinstance(first_surface, ContactHalfSpace) and isinstance(
            second_surface, ContactHalfSpace
        )
        # Two half spaces have no defined contact, and a body does not touch itself.
        if are_half_spaces or bodies[0] == bodies[1] or None in geom_records:
            continue
        # MuJoCo's contact has a stiffness of its own, and would support the bodies.
        if not find_stiffness(first_stiffness, second_stiffness) > 0.0:
            continue
        geoms = [str(geom_record).removeprefix("geom ") for geom_record in geom_records]
        name = draft.make_name("pair", ".".join(geoms))
        # Simbody combines two coefficients by their harmonic mean.
        sliding = (
            2.0 * first_friction * second_friction / (first_friction + second_friction)
            if first_friction + second_friction
            else 0.0
        )
        # OpenSim has no torsional or rolling friction.
        friction = (sliding, sliding, 0.0, 0.0, 0.0)
        add_element(
            draft.get_section("contact"),
            "pair",
            name=name,
            geom1=geoms[0],
            geom2=geoms[1],
            friction=friction,
        )
        yield name


def _iterate_surfaces(
    draft: MjcfDraft, force: ContactForce
) -> Iterator[tuple[ContactGeometry, float, float]]:
    """Yield the surfaces of a force with the dynamic friction coefficient and the stiffness of each.

    Raises:
        ModelError: the force names a contact geometry that the model does not have.
    """
    if isinstance(force, SmoothSphereHalfSpaceForce):
        for socket in ("socket_sphere", "socket_half_space"):
            surface = draft.tree.target(force, socket, getattr(force, socket))
            if isinstance(surface, ContactGeometry):
                yield surface, force.dynamic_friction, force.stiffness
        return
    for parameters in force.contact_parameters.objects:
        spec = type(parameters).field_specs()["geometry"]
        for position, geometry_name in enumerate(parameters.geometry):
            result = draft.tree.resolve(
                Use(parameters, force, spec, geometry_name, position)
            ).target
            if not isinstance(result, ContactGeometry):
                raise ModelError(
                    f"it names the contact geometry '{geometry_name}', which the model does not have"
                )
            yield result, parameters.dynamic_friction, parameters.stiffness
