"""Contact of meshes by an elastic foundation, as a force element.

As in Simbody, meshes touch half spaces, spheres and each other; nothing else touches in such a force. The springs of
two meshes are both taken, each with half its area.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from osimlite.errors import ModelError
from osimlite.forces.elastic_foundation import spring_in_half_space, spring_in_sphere, spring_load
from osimlite.multibody.spatial import Array, transform
from osimlite.schema.contact import ContactMesh
from osimlite.schema.contact_forces import ElasticFoundationForce
from osimlite.simulation.contact_elements import (
    ContactPair,
    ContactSurface,
    Material,
    PairContact,
    geometries,
    place_of,
    surface_of,
)
from osimlite.simulation.elements import ElementBuilder, Triple, triple
from osimlite.simulation.triangle_mesh import TriangleMesh

if TYPE_CHECKING:
    from osimlite.simulation.field import Writer

Load = tuple[float, float, float, float, float, float, float]
"""Force (N), torque about a point (N·m), and energy (J)."""

Moving = tuple[float, float, float, float, float, float]
"""Velocity of a point (m/s), and angular velocity (1/s)."""


@dataclass(frozen=True)
class ElasticFoundation(PairContact):
    """One ElasticFoundationForce; surface 2 of each pair is a mesh, surface 1 may be one."""

    def write(self, writer: Writer) -> None:
        """Write what happens where the balls around the surfaces touch."""
        script, chain = writer.script, writer.chain
        for place, pair in enumerate(self.pairs):
            one, two = self.surfaces[pair.first], self.surfaces[pair.second]
            center, other = chain.point(script, two.body, two.center), chain.point(script, one.body, one.center)
            gap = script.combine((1.0, center), (-1.0, other))
            if one.is_half_space:
                apart = script.dot(gap, chain.direction(script, one.body, one.normal))
                touching = f"{apart} < {two.radius!r}"
            else:
                reach = one.radius + two.radius
                touching = f"{script.dot(gap, gap)} < {reach * reach!r}"
            with script.block(f"if {touching}:"):
                columns = chain.columns(script, one.body, two.body, center)
                moving, turning = (
                    script.combine((-1.0, chain.velocity(script, columns, turning=turning)))
                    for turning in (False, True)
                )
                poses = [
                    number
                    for placed in (chain.body(script, one.body), chain.body(script, two.body))
                    for number in (*(entry for row in placed.rotation for entry in row), *placed.origin)
                ]
                springs = writer.constant(partial(_load, Springs(one, two, self.vt)))
                *load, energy = writer.call(springs, *poses, *center, *moving, *turning, results=7)
                force, torque = (load[0], load[1], load[2]), (load[3], load[4], load[5])
                writer.keep(place, *force, *center, *torque, *([energy] if writer.reporting else []))
                with script.block(f"if {force[0]} != 0.0 or {force[1]} != 0.0 or {force[2]} != 0.0:"):
                    writer.push(columns, force)
                    writer.turn(columns, torque)
                    writer.touch(place, force)
                    script.line("pass")

    def torque(self, value: Sequence[Any]) -> Triple:
        """What turns surface 2 besides the force."""
        return triple(value[6:9])


def elastic_foundation(builder: ElementBuilder, force: ElasticFoundationForce) -> ElasticFoundation:
    """The element of an ElasticFoundationForce.

    Raises:
        ModelError: a mesh file is missing or not a closed surface.
        OsimliteError: a mesh file cannot be read.
        UnsupportedError: a surface is neither a mesh, a half space, a sphere nor an ellipsoid.
    """
    surfaces = []
    for geometry, material in geometries(builder, force):
        if isinstance(geometry, ContactMesh):
            surfaces.append(_mesh_surface(builder, force, geometry, material))
        else:
            surfaces.append(surface_of(builder, force, geometry, material))
    builder.check(force, (force.transition_velocity, *(x for surface in surfaces for x in surface.material)))
    pairs = []
    for first, second in combinations(range(len(surfaces)), 2):
        if surfaces[second].mesh is None:
            first, second = second, first
        a, b = surfaces[first], surfaces[second]
        if a.body != b.body and b.mesh is not None and a.radii is None:
            pairs.append(ContactPair(first, second, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)))
    path, vt = builder.path(force), force.transition_velocity
    return ElasticFoundation(path, force.name, tuple(surfaces), tuple(pairs), vt)


def _mesh_surface(builder: ElementBuilder, force: Any, geometry: ContactMesh, material: Material) -> ContactSurface:
    frame, body, placed = place_of(builder, geometry)
    builder.check(geometry, placed.ravel().tolist())
    if not geometry.filename:
        raise ModelError(f"the contact mesh '{builder.path(geometry)}' names no file; give it one")
    if material[0] < 0.0:
        raise ModelError(f"the force '{builder.path(force)}': a contact stiffness must not be negative")
    mesh = TriangleMesh.read(geometry.filename, builder.mesh_folders).moved(placed)
    center, still = triple(mesh.center), (0.0, 0.0, 0.0)
    return ContactSurface(geometry.name, body, frame, center, mesh.radius, still, material, mesh=mesh)


class Springs:
    """The springs of a pair of surfaces.

    Args:
        one: surface 1.
        two: surface 2, a mesh.
        vt: transition velocity, m/s.
    """

    def __init__(self, one: ContactSurface, two: ContactSurface, vt: float) -> None:
        assert two.mesh is not None
        self.one, self.two, self.mesh, self.vt = one, two, two.mesh, vt
        meshes = [surface for surface in (one, two) if surface.mesh is not None]
        # Of two meshes, each has half the area.
        self._stiffness = [
            surface.material[0] / len(meshes) * surface.mesh.areas for surface in meshes if surface.mesh is not None
        ]

    def load(self, one: Pose, two: Pose, about: Triple, motion: Moving) -> Load:
        """The load on surface 2.

        Args:
            one: where the body of surface 1 is, in ground.
            two: where the body of surface 2 is.
            about: point for the torque, m.
            motion: velocity at that point (m/s) and angular velocity (1/s) of surface 1 relative to surface 2.
        """
        if self.one.mesh is not None:
            return self._between_meshes(self.one.mesh, one, two, about, motion)
        middles = two.points(self.mesh.centroids)
        place = one.points(np.array(self.one.center))
        find: Callable[..., tuple[float, float, float, float]]
        if self.one.is_half_space:
            normal = one.turn @ self.one.normal
            inside = (middles - place) @ normal < 0.0
            find = partial(spring_in_half_space, *triple(place), *triple(normal))
        else:
            inside = np.linalg.norm(middles - place, axis=1) <= self.one.radius
            find = partial(spring_in_sphere, *triple(place), self.one.radius)
        acting = []
        for k, x, y, z in np.column_stack((self._stiffness[-1], middles))[inside].tolist():
            depth, *end = find(x, y, z)
            if depth > 0.0:
                acting.append((k, x, y, z, *end))
        return self._sum(self.two, acting, about, motion)

    def _between_meshes(self, first: TriangleMesh, one: Pose, two: Pose, about: Triple, motion: Moving) -> Load:
        own = _inside(self._stiffness[0], first, one, self.mesh, two)
        others = _inside(self._stiffness[1], self.mesh, two, first, one)
        # As in Simbody, a mesh that is wholly within another does not touch it.
        if not (own or others) or not (
            any(
                mesh.is_one_piece and 0 < len(found) < len(mesh.triangles)
                for mesh, found in ((first, own), (self.mesh, others))
            )
            or first.crosses(self.mesh.moved(one.inverse_times(two)))
        ):
            return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        vx, vy, vz, wx, wy, wz = motion
        *first_load, first_energy = self._sum(self.one, own, about, (-vx, -vy, -vz, -wx, -wy, -wz))
        *second_load, second_energy = self._sum(self.two, others, about, motion)
        fx, fy, fz, tx, ty, tz = (b - a for a, b in zip(first_load, second_load, strict=True))
        return fx, fy, fz, tx, ty, tz, first_energy + second_energy

    def _sum(self, surface: ContactSurface, acting: Iterable[Sequence[float]], about: Triple, motion: Moving) -> Load:
        """The load on a mesh of the springs that act: stiffness, middle and end of each."""
        _, c, us, ud, uv = surface.material
        ax, ay, az = about
        vx, vy, vz, wx, wy, wz = motion
        vt, law = self.vt, spring_load
        fx = fy = fz = tx = ty = tz = energy = 0.0
        for k, x, y, z, ex, ey, ez in acting:
            px, py, pz, qx, qy, qz, stored = law(
                k, c, us, ud, uv, vt, x, y, z, ex, ey, ez, ax, ay, az, vx, vy, vz, wx, wy, wz
            )
            fx += px
            fy += py
            fz += pz
            tx += qx
            ty += qy
            tz += qz
            energy += stored
        return fx, fy, fz, tx, ty, tz, energy


class Pose(NamedTuple):
    """Where a body is in ground: rotation (3, 3) and origin (3,)."""

    turn: Array
    origin: Array

    def points(self, stations: Array) -> Array:
        """Stations of the body, in ground."""
        return stations @ self.turn.T + self.origin

    def inverse_times(self, other: Pose) -> Array:
        """The other pose seen from this one, as a matrix (4, 4)."""
        return transform(self.turn.T @ other.turn, self.turn.T @ (other.origin - self.origin))


def _inside(stiffness: Array, mesh: TriangleMesh, own: Pose, other: TriangleMesh, theirs: Pose) -> list[list[float]]:
    """The springs of a mesh that are inside another: stiffness, middle and end of each."""
    middles = own.points(mesh.centroids)
    seen = (middles - theirs.origin) @ theirs.turn
    boxed = np.all((seen >= other.points.min(axis=0)) & (seen <= other.points.max(axis=0)), axis=1)
    places = np.flatnonzero(boxed)
    if not len(places):
        return []
    ends, inside = other.nearest(seen[places])
    acting = places[inside]
    found: list[list[float]] = np.column_stack(
        (stiffness[acting], middles[acting], theirs.points(ends[inside]))
    ).tolist()
    return found


def _load(springs: Springs, *numbers: float) -> Load:
    """The load, from plain numbers: two poses by rows and origin, a point, a velocity and an angular velocity."""
    given = np.array(numbers[:24])
    one, two = (Pose(given[start : start + 9].reshape(3, 3), given[start + 9 : start + 12]) for start in (0, 12))
    vx, vy, vz, wx, wy, wz = numbers[27:]
    return springs.load(one, two, triple(numbers[24:27]), (vx, vy, vz, wx, wy, wz))
