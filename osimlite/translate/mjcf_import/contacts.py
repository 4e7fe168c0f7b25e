"""Contact: geoms that can collide as contact surfaces, and Hunt-Crossley forces between them.

MuJoCo's contacts are soft constraints with their own friction law; a Hunt-Crossley force is another
law. Its stiffness is such that it yields as far as MuJoCo's contact does under the weight of the
bodies that move.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from osimlite.base.text import format_count
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.contact import ContactGeometry
from osimlite.schema.contact_types import (
    ContactEllipsoid,
    ContactHalfSpace,
    ContactMesh,
    ContactSphere,
)
from osimlite.schema.forces import HuntCrossleyForce
from osimlite.translate.mjcf_import.draft import (
    ConversionDraft,
    angles_of,
    quaternion_matrix,
    vector,
)
from osimlite.translate.mjcf_import.joints import compute_softness
from osimlite.translate.mjcf_import.shapes import (
    BOX,
    CAPSULE,
    ELLIPSOID,
    MESH,
    PLANE,
    SPHERE,
    write_mesh,
)

PLANE_TO_HALF_SPACE = np.array(((0.0, 0.0, -1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))).T
"""Frame of a half space (outward normal -x) in that of a plane (outward normal z), as a rotation."""
CORNER_RADIUS = 0.1
"""Radius of the spheres in the corners of a box, as a part of its smallest half length."""
DISSIPATION_S_M = 1.0
"""Dissipation of all contact forces."""
TRANSITION_M_S = 0.1
"""Transition velocity of all contact forces."""


def add_contacts(draft: ConversionDraft) -> None:
    """Add the contact surfaces of a model, and Hunt-Crossley forces between planes and round geoms.

    The option `contact` selects what is added: "none" adds nothing, "geometry" the surfaces of all
    geoms that can collide, "forces" the surfaces and the forces. What is left out or approximated
    is recorded.

    Args:
        draft: OpenSim model under construction, to which the elements are added.
    """
    if draft.options.contact == "none":
        _record_left_out(draft)
        return
    surfaces: dict[int, list[ContactGeometry]] = {}
    # Sorted, so that equal files give equal models.
    for geom in sorted(_find_colliding_geoms(draft)):
        geom_surfaces = _make_surfaces(draft, geom)
        if geom_surfaces:
            surfaces[geom] = geom_surfaces
            for surface in geom_surfaces:
                draft.model.add(surface)
    if draft.options.contact == "forces":
        _add_forces(draft, surfaces)


def _record_left_out(draft: ConversionDraft) -> None:
    """Record that the contact of every geom that can collide is left out."""
    for geom in sorted(_find_colliding_geoms(draft)):
        draft.record("geom", geom, "contact", "left out, as requested")


def _find_colliding_geoms(draft: ConversionDraft) -> set[int]:
    """Return the indices of the geoms that can touch another one."""
    model = draft.mj
    result = {int(geom) for pair in range(model.npair) for geom in _get_pair(model, pair)}
    types, affinities = model.geom_contype, model.geom_conaffinity
    for geom in range(model.ngeom):
        # MuJoCo's test: the type of one and the affinity of the other, in either order.
        can_touch = (types[geom] & affinities) | (affinities[geom] & types)
        if np.any(can_touch[np.arange(model.ngeom) != geom]):
            result.add(geom)
    return result


def _get_pair(model: object, pair: int) -> tuple[int, int]:
    """Return the indices of the two geoms of an explicit contact pair of the file."""
    return int(model.pair_geom1[pair]), int(model.pair_geom2[pair])  # type: ignore[attr-defined]


def _make_surfaces(draft: ConversionDraft, geom: int) -> list[ContactGeometry]:
    """Return the contact surfaces in place of a geom; none, with a record, if OpenSim has none for it."""
    model = draft.mj
    name = draft.source.name_of("geom", geom)
    frame = draft.frames[int(model.geom_bodyid[geom])]
    position = np.array(model.geom_pos[geom])
    rotation = quaternion_matrix(model.geom_quat[geom])
    size = [float(value) for value in model.geom_size[geom]]
    geom_type = int(model.geom_type[geom])

    def make_sphere(center: Array, radius: float) -> ContactSphere:
        """Return a sphere around a point in the frame of the geom (m)."""
        return ContactSphere(
            name=draft.unique("contact", name),
            socket_frame=frame,
            location=vector(position + rotation @ center),
            radius=radius,
        )

    if geom_type == PLANE:
        return [
            ContactHalfSpace(
                name=draft.unique("contact", name),
                socket_frame=frame,
                location=vector(position),
                orientation=angles_of(rotation @ PLANE_TO_HALF_SPACE),
            )
        ]
    if geom_type == SPHERE:
        return [make_sphere(np.zeros(3), size[0])]
    if geom_type == CAPSULE:
        draft.record("geom", geom, "contact of a capsule", "contact of the spheres at its ends")
        return [make_sphere(np.array((0.0, 0.0, end)), size[0]) for end in (-size[1], size[1])]
    if geom_type == BOX:
        # Spheres in the corners touch a plane as the box does, up to rounded corners.
        radius = CORNER_RADIUS * min(size)
        draft.record(
            "geom",
            geom,
            "contact of a box",
            "contact of spheres in its corners",
            f"radius {radius:g} m",
        )
        # The spheres lie inside of the box.
        return [
            make_sphere(np.array(signs) * (np.array(size) - radius), radius)
            for signs in product((-1.0, 1.0), repeat=3)
        ]
    if geom_type == ELLIPSOID:
        return [
            ContactEllipsoid(
                name=draft.unique("contact", name),
                socket_frame=frame,
                location=vector(position),
                orientation=angles_of(rotation),
                radii=vector(size),
            )
        ]
    if geom_type == MESH and int(model.geom_dataid[geom]) >= 0:
        file = write_mesh(draft, int(model.geom_dataid[geom]))
        draft.record(
            "geom",
            geom,
            "contact of the convex hull of a mesh",
            "a ContactMesh without a force: an ElasticFoundationForce can be added",
            file,
        )
        return [
            ContactMesh(
                name=draft.unique("contact", name),
                socket_frame=frame,
                location=vector(position),
                orientation=angles_of(rotation),
                filename=file,
            )
        ]
    draft.record("geom", geom, "contact of a cylinder or a height field", "left out")
    return []


def _add_forces(draft: ConversionDraft, surfaces: dict[int, list[ContactGeometry]]) -> None:
    """Add a force between each plane and each round geom that can touch it; record other pairs.

    Args:
        draft: OpenSim model under construction.
        surfaces: contact surfaces of each geom, by its index.
    """
    model = draft.mj
    unsupported_counts: dict[int, int] = {}
    pairs = {tuple(sorted(_get_pair(model, pair))): pair for pair in range(model.npair)}
    touching_pairs = [
        (first, second)
        for position, first in enumerate(surfaces)
        for second in list(surfaces)[position + 1 :]
        if (first, second) in pairs or _can_touch(draft, first, second)
    ]
    for first, second in touching_pairs:
        planes = [geom for geom in (first, second) if int(model.geom_type[geom]) == PLANE]
        round_geoms = [
            geom
            for geom in (first, second)
            if int(model.geom_type[geom]) in (SPHERE, CAPSULE, ELLIPSOID, BOX)
        ]
        # OpenSim's Hunt-Crossley force acts between half spaces and round shapes.
        if len(planes) != 1 or len(round_geoms) != 1:
            for geom in (first, second):
                unsupported_counts[geom] = unsupported_counts.get(geom, 0) + 1
            continue
        _add_force(draft, surfaces, planes[0], round_geoms[0], pairs.get((first, second)))
    for geom, count in unsupported_counts.items():
        draft.record(
            "geom",
            geom,
            "contact with other shapes than planes",
            "contact surfaces without a force",
            format_count(count, "other geom"),
        )


def _can_touch(draft: ConversionDraft, first: int, second: int) -> bool:
    """Return whether MuJoCo tests two geoms for contact, without the explicit pairs of the file."""
    model = draft.mj
    types, affinities = model.geom_contype, model.geom_conaffinity
    if not (types[first] & affinities[second] or types[second] & affinities[first]):
        return False
    bodies = [int(model.body_weldid[model.geom_bodyid[geom]]) for geom in (first, second)]
    parents = [int(model.body_weldid[model.body_parentid[body]]) for body in bodies]
    # Geoms of one rigid body do not move against each other.
    if bodies[0] == bodies[1]:
        return False
    # A body does not touch its parent, unless this is the world.
    if 0 not in bodies and (bodies[0] == parents[1] or bodies[1] == parents[0]):
        return False
    # MuJoCo stores both bodies in one integer.
    signature = {
        (int(model.geom_bodyid[first]) << 16) + int(model.geom_bodyid[second]),
        (int(model.geom_bodyid[second]) << 16) + int(model.geom_bodyid[first]),
    }
    return not signature & {int(value) for value in model.exclude_signature}


def _add_force(
    draft: ConversionDraft,
    surfaces: dict[int, list[ContactGeometry]],
    plane: int,
    geom: int,
    pair: int | None,
) -> None:
    model = draft.mj
    body = int(model.geom_bodyid[geom])
    root_body = int(model.body_rootid[body])
    mass = float(model.body_subtreemass[root_body])
    if pair is None:
        # MuJoCo's mixing rule for the parameters of two geoms.
        weights = model.geom_solmix[[plane, geom]]
        mix = weights / weights.sum() if weights.sum() > 0.0 else np.array((0.5, 0.5))
        reference = mix @ model.geom_solref[[plane, geom]]
        impedance = mix @ model.geom_solimp[[plane, geom]]
        # Of two frictions MuJoCo takes the larger.
        friction = float(model.geom_friction[[plane, geom], 0].max())
    else:
        reference, impedance = model.pair_solref[pair], model.pair_solimp[pair]
        friction = float(model.pair_friction[pair, 0])
    linear, _ = compute_softness(reference, impedance, 1.0 / max(mass, 1e-6))
    # Without gravity any weight will do.
    weight = max(mass * float(np.linalg.norm(model.opt.gravity)), 1e-3)
    depth = weight / linear
    radius = float(model.geom_size[geom, 0])
    if int(model.geom_type[geom]) == BOX:
        radius = CORNER_RADIUS * float(model.geom_size[geom].min())
    # Simbody: F = 4/3 K^(3/2) sqrt(R) d^(3/2), where K is k^(2/3) / 2 for two surfaces of the
    # same stiffness k.
    stiffness = 2.0**1.5 * 0.75 * weight / (math.sqrt(radius) * depth**1.5)
    name = draft.unique("force", f"{draft.source.name_of('geom', geom)}_contact")
    material = HuntCrossleyForce.ContactParameters(
        geometry=tuple([*surfaces[plane], *surfaces[geom]]),
        stiffness=stiffness,
        dissipation=DISSIPATION_S_M,
        static_friction=friction,
        dynamic_friction=friction,
        viscous_friction=0.0,
    )
    draft.model.add(
        HuntCrossleyForce(
            name=name,
            contact_parameters=HuntCrossleyForce.ContactParametersSet(objects=[material]),
            transition_velocity=TRANSITION_M_S,
        )
    )
    draft.record(
        "geom",
        geom,
        "contact by MuJoCo's soft constraint",
        "a HuntCrossleyForce with the same depth under the weight of the bodies; motions differ",
        f"force {name}, stiffness {stiffness:.4g} N/m^2, {depth:.3g} m under {weight:.4g} N",
    )
