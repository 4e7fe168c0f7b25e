"""Contact of meshes by an elastic foundation, in pairs (Simbody's ElasticFoundationForce).

Every triangle of a mesh has a spring at its centroid, with the triangle's area. As in Simbody,
meshes touch half spaces, spheres and each other; other surfaces of such a force do not touch.
Between two meshes both have springs, each with half its area.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations
from typing import Any, ClassVar

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass
from osimlite.errors import ModelError
from osimlite.mechanics.kernels.layout import ITEM, LINK_WORK, MODEL
from osimlite.mechanics.kernels.mesh_contacts import MESH_WORK, apply_mesh_load
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.kernels.points import angular_velocity, station, velocity
from osimlite.mechanics.laws.elastic_foundation import FoundationSpring, spring_load
from osimlite.mechanics.laws.vectors import ZERO, Vector, minus, plus, times
from osimlite.mechanics.multibody.links import LinkMap, Placement
from osimlite.mechanics.multibody.mechanism import GROUND
from osimlite.mechanics.multibody.spatial import Array, make_transform
from osimlite.schema.contact_forces import ElasticFoundationForce
from osimlite.schema.contact_types import ContactMesh
from osimlite.simulation.elements.builder import ElementBuilder, to_triple
from osimlite.simulation.elements.contact import (
    ContactPair,
    ContactSurface,
    Material,
    PairContact,
    find_frame,
    read_geometries,
    read_surface,
)
from osimlite.simulation.elements.force_records import ForceRecord
from osimlite.simulation.elements.registry import register_force_type
from osimlite.simulation.elements.triangle_mesh import TriangleMesh

Load = tuple[Vector, Vector, float]
"""Force (N), torque about a point (N·m), and energy (J)."""


@register_force_type
@dataclass(frozen=True)
class ElasticFoundation(PairContact):
    """ElasticFoundationForce; surface 2 of each pair is a mesh, surface 1 may be one."""

    component: ClassVar = ElasticFoundationForce

    @classmethod
    def make(cls, builder: ElementBuilder, force: ElasticFoundationForce) -> ElasticFoundation:
        """Return the element of a force.

        Raises:
            ModelError: a mesh file is missing or is not a closed surface.
            OsimliteError: a mesh file cannot be read.
            UnsupportedError: a surface is not a mesh, half space, sphere or ellipsoid.
        """
        # Meshes have springs; the other surfaces are as in other contact forces.
        surfaces = []
        for geometry, material in read_geometries(builder, force):
            if isinstance(geometry, ContactMesh):
                surfaces.append(_read_mesh(builder, force, geometry, material))
            else:
                surfaces.append(read_surface(builder, force, geometry, material))
        builder.check_finite(
            force,
            (force.transition_velocity, *(x for surface in surfaces for x in surface.material)),
        )
        pairs = []
        for first, second in combinations(range(len(surfaces)), 2):
            # The kernels expect the mesh second, as it carries the springs.
            if surfaces[second].mesh is None:
                first, second = second, first
            a, b = surfaces[first], surfaces[second]
            # Surfaces of one body, and ellipsoids (`radii`), do not touch a mesh.
            if a.body != b.body and b.mesh is not None and a.radii is None:
                # The law takes the material of the mesh alone, so nothing is combined.
                pairs.append(ContactPair(first, second, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)))
        return cls(
            builder.path(force),
            force.name,
            tuple(surfaces),
            tuple(pairs),
            force.transition_velocity,
        )

    def make_records(self, link_map: LinkMap) -> list[ForceRecord]:
        """Return a contact record for each pair, then the records that compute them."""
        contacts = [
            ForceRecord("touch_mesh", (GROUND, GROUND), is_contact=True, is_part=True)
            for _ in self.pairs
        ]
        return contacts + [
            self._make_pair(number, pair, link_map) for number, pair in enumerate(self.pairs)
        ]

    def _make_pair(self, number: int, pair: ContactPair, link_map: LinkMap) -> ForceRecord:
        one, two = self.surfaces[pair.first], self.surfaces[pair.second]
        links, numbers = self.pack_pair(pair, link_map)
        # The kernel takes the springs of one mesh; two meshes are computed in Python.
        assert two.mesh is not None
        ints = *links, number, len(two.mesh.areas), int(one.is_half_space)
        if one.mesh is not None:
            touching = _Meshes(
                Springs(one, two, self.vt),
                link_map.placement(one.body),
                link_map.placement(two.body),
            )
            return ForceRecord("", ints, numbers, record_size=MESH_WORK, python=touching)
        stiffness, *material = two.material
        middles = (link_map.station(two.body, middle)[1] for middle in two.mesh.centroids.tolist())
        springs = (
            x
            for area, middle in zip(two.mesh.areas.tolist(), middles, strict=True)
            # Each spring is its stiffness times area and its place.
            for x in (stiffness * area, *middle)
        )
        return ForceRecord(
            "touch_mesh", ints, (*numbers[:11], *material, self.vt, *springs), record_size=MESH_WORK
        )

    def find_torque(self, records: Sequence[Sequence[float]], pair: ContactPair) -> Sequence[float]:
        """Return the torque (N.m) on surface 2 in addition to that of the force."""
        return records[len(self.pairs) + self.pairs.index(pair)][6:9]

    def compute_energy(self, records: Sequence[Sequence[float]]) -> float:
        """Return the potential energy, J."""
        return sum(record[9] for record in records[len(self.pairs) :])


def _read_mesh(
    builder: ElementBuilder, force: Any, geometry: ContactMesh, material: Material
) -> ContactSurface:
    frame, body, frame_in_body = find_frame(builder, geometry)
    builder.check_finite(geometry, frame_in_body.ravel().tolist())
    if not geometry.filename:
        raise ModelError(f"the contact mesh '{builder.path(geometry)}' names no file; give it one")
    if material[0] < 0.0:
        raise ModelError(
            f"the force '{builder.path(force)}': a contact stiffness must not be negative"
        )
    mesh = TriangleMesh.read(geometry.filename, builder.mesh_folders).transform(frame_in_body)
    center = to_triple(mesh.center)
    still = (0.0, 0.0, 0.0)
    return ContactSurface(
        geometry.name, body, frame, center, mesh.radius, still, material, mesh=mesh
    )


class Springs:
    """Springs of two meshes that touch, each with half the area of its triangle.

    Args:
        one: mesh that is surface 1.
        two: mesh that is surface 2.
        vt: transition velocity, m/s.
    """

    def __init__(self, one: ContactSurface, two: ContactSurface, vt: float) -> None:
        assert one.mesh is not None and two.mesh is not None
        self.one, self.two, self.vt = one, two, vt
        self._first, self._second = one.mesh, two.mesh
        self._stiffness = [
            0.5 * surface.material[0] * mesh.areas
            for surface, mesh in ((one, one.mesh), (two, two.mesh))
        ]

    def load(self, one: Pose, two: Pose, about: Vector, v: Vector, turning: Vector) -> Load:
        """Return the load on surface 2.

        Args:
            one: pose of the body of surface 1 in ground.
            two: pose of the body of surface 2 in ground.
            about: point for the torque, m.
            v: velocity of surface 1 relative to surface 2 at that point, m/s.
            turning: angular velocity of surface 1 relative to surface 2, 1/s.

        Returns:
            Force (N), torque about the point (N·m), and stored energy (J).
        """
        first, second = self._first, self._second
        springs = _find_springs_inside(self._stiffness[0], first, one, second, two)
        others = _find_springs_inside(self._stiffness[1], second, two, first, one)
        # As in Simbody, a mesh that is completely inside another does not touch it.
        if not (springs or others) or not (
            any(
                mesh.is_one_piece and 0 < len(result) < len(mesh.triangles)
                for mesh, result in ((first, springs), (second, others))
            )
            or first.crosses(second.transform(one.inverse_times(two)))
        ):
            return ZERO, ZERO, 0.0
        force1, torque1, energy1 = self._add_springs(
            self.one, springs, about, times(-1.0, v), times(-1.0, turning)
        )
        force2, torque2, energy2 = self._add_springs(self.two, others, about, v, turning)
        return minus(force2, force1), minus(torque2, torque1), energy1 + energy2

    def _add_springs(
        self,
        surface: ContactSurface,
        acting: Iterable[Sequence[float]],
        about: Vector,
        v: Vector,
        turning: Vector,
    ) -> Load:
        """Return the load on a mesh of its active springs.

        Args:
            surface: surface of the mesh.
            acting: stiffness, middle (m) and end (m) of each active spring.
            about: point for the torque, m.
            v: velocity of the other surface at that point, m/s.
            turning: angular velocity of the other surface, 1/s.
        """
        _, c, us, ud, uv = surface.material
        # Surface 1 pushes back with the opposite force.
        force = torque = ZERO
        energy = 0.0
        for k, x, y, z, *end in acting:
            spring_force, spring_torque, stored = spring_load(
                FoundationSpring(k, c, us, ud, uv, self.vt),
                (x, y, z),
                to_triple(end),
                about,
                v,
                turning,
            )
            force = plus(force, spring_force)
            torque = plus(torque, spring_torque)
            energy += stored
        return force, torque, energy


class Pose(NamedTuple):
    """Pose of a body in ground.

    Attributes:
        turn: rotation (3, 3).
        origin: origin (3,), m.
    """

    turn: Array
    origin: Array

    def points(self, stations: Array) -> Array:
        """Return stations of the body, in ground."""
        return stations @ self.turn.T + self.origin

    def inverse_times(self, other: Pose) -> Array:
        """Return the other pose relative to this one, as a matrix (4, 4)."""
        return make_transform(self.turn.T @ other.turn, self.turn.T @ (other.origin - self.origin))


def _find_springs_inside(
    stiffness: Array, mesh: TriangleMesh, pose: Pose, other: TriangleMesh, theirs: Pose
) -> list[list[float]]:
    """Return the springs of a mesh that are inside another mesh.

    Args:
        stiffness: stiffness of each spring (t,).
        mesh: mesh with the springs.
        pose: pose in ground of the body of `mesh`.
        other: mesh that the springs may be inside.
        theirs: pose in ground of the body of `other`.

    Returns:
        Stiffness, middle (m) and end (m, the nearest point of the other mesh) of each spring, in
        ground.
    """
    middles = pose.points(mesh.centroids)
    # Springs in the frame of the other mesh, where its bounding box is fixed.
    middles_in_other = (middles - theirs.origin) @ theirs.turn
    # The bounding box excludes most springs before the costly search.
    is_in_box = np.all(
        (middles_in_other >= other.points.min(axis=0))
        & (middles_in_other <= other.points.max(axis=0)),
        axis=1,
    )
    candidates = np.flatnonzero(is_in_box)
    if not len(candidates):
        return []
    ends, inside = other.find_nearest(middles_in_other[candidates])
    acting = candidates[inside]
    return np.column_stack(
        (stiffness[acting], middles[acting], theirs.points(ends[inside]))
    ).tolist()


@dataclass(frozen=True)
class _Meshes:
    """Function that computes the contact of two meshes, in Python.

    Attributes:
        springs: springs of both meshes.
        one: placement of the body of surface 1 in its link.
        two: placement of the body of surface 2 in its link.
    """

    springs: Springs  # springs of both meshes
    one: Placement  # placement of the body of surface 1 in its link
    two: Placement  # placement of the body of surface 2 in its link

    def __call__(
        self, model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int
    ) -> None:
        """Compute and apply the contact."""
        data[model[item + ITEM.RECORD] :][:MESH_WORK] = 0.0
        one, two = self._find_pose(model, data, self.one), self._find_pose(model, data, self.two)
        first, second = self.springs.one, self.springs.two
        about, other = two.points(np.array(second.center)), one.points(np.array(first.center))
        point: Vector = tuple(about.tolist())
        load: Load = ZERO, ZERO, 0.0
        # Balls around the meshes that do not overlap need no search.
        if np.linalg.norm(about - other) < first.radius + second.radius:
            links = self.one.link, self.two.link
            v = minus(*(velocity(model, data, link, point) for link in links))
            load = self.springs.load(
                one, two, point, v, minus(*(angular_velocity(model, data, link) for link in links))
            )
        apply_mesh_load(model, data, item, point, *load)

    @staticmethod
    def _find_pose(model: Ints, data: Floats, placement: Placement) -> Pose:
        """Return the pose in ground of a frame that is fixed to a link, after an evaluation.

        Args:
            model: integers of the model.
            data: results of the evaluation.
            placement: index of the link, negative for ground, and the frame in it.
        """
        link, frame = placement
        if link < 0:
            return Pose(frame[:3, :3], frame[:3, 3])
        start = model[MODEL.WORK_LINK] + LINK_WORK.SIZE * link
        origin = np.array(station(model, data, link, to_triple(frame[:3, 3])))
        return Pose(data[start : start + 9].reshape(3, 3) @ frame[:3, :3], origin)
