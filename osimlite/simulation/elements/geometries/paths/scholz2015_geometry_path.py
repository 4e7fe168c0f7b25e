"""A cable: a path through points and over obstacles that it may touch.

OpenSim hands over the places of points and surfaces as if the frames that they are in were those of
the bodies; only forces at points are applied where they belong. So it is here.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any, ClassVar

import numpy as np

from osimlite.base.records import dataclass, replace
from osimlite.errors import ModelError, OsimliteError
from osimlite.mechanics.kernels.cable_paths import (
    ELEMENT_INTS,
    ELEMENTS,
    FIRST,
    GEODESIC,
    GUESSED,
    KEPT,
    LIFTED,
    OBSTACLE_WORK,
    POINT_WORK,
    STATE,
    TOUCH_NUMBERS,
    TRACKED,
    cable_path,
    solver_room,
)
from osimlite.mechanics.kernels.cable_surfaces import (
    CYLINDER,
    ELLIPSOID,
    END,
    POINT,
    SPHERE,
    START,
    STEP,
    TORUS,
    value,
)
from osimlite.mechanics.kernels.layout import ITEM
from osimlite.mechanics.kernels.paths import LENGTH
from osimlite.mechanics.kernels.wrap_curves import MOST
from osimlite.mechanics.multibody.links import Placement, Places
from osimlite.mechanics.multibody.mechanism import GROUND, Mechanism
from osimlite.mechanics.multibody.spatial import Array, make_offset
from osimlite.schema.contact import (
    ContactCylinder,
    ContactEllipsoid,
    ContactGeometry,
    ContactHalfSpace,
    ContactSphere,
    ContactTorus,
)
from osimlite.schema.scholz_paths import Scholz2015GeometryPath, Scholz2015GeometryPathPoint
from osimlite.simulation.elements.builder import ElementBuilder, kind_of
from osimlite.simulation.elements.force_records import ForceRecord
from osimlite.simulation.elements.registry import register_path

FIRST_STEP = 1e-10
"""Of the first integration of a geodesic, m."""


@dataclass(frozen=True, eq=False)
class Point:
    """A point of a cable."""

    body: int  # that it is in
    runs: Array  # station in the body that the cable runs through, m
    pulls: Array  # station in the body that it pulls at, m

    work: ClassVar[int] = POINT_WORK
    is_obstacle: ClassVar[bool] = False

    def packed(self, places: Places) -> tuple[int, list[float]]:
        """Its link and numbers."""
        link, runs = places.station(self.body, self.runs.tolist())
        _, pulls = places.station(self.body, self.pulls.tolist())
        return link, [*runs, *pulls]


@dataclass(frozen=True, eq=False)
class Obstacle:
    """A surface that a cable may touch."""

    body: int  # that it is in
    frame: Array  # (4, 4) of the surface in the body
    surface: tuple[float, ...]  # its numbers
    begin: Array  # how the cable is on it before a search

    work: ClassVar[int] = OBSTACLE_WORK
    is_obstacle: ClassVar[bool] = True

    def packed(self, places: Places) -> tuple[int, list[float]]:
        """Its link and numbers."""
        link, placed = places.placement(self.body)
        frame = placed @ self.frame
        return link, [
            *frame[:3, :3].ravel().tolist(),
            *frame[:3, 3].tolist(),
            *self.begin.tolist(),
            *self.surface,
        ]


@dataclass(frozen=True)
class Cable:
    """A path over obstacles."""

    # points and obstacles in the order in which it passes them
    elements: tuple[Point | Obstacle, ...]

    coupled: ClassVar[bool] = True
    trace: ClassVar[str] = "trace_cable"
    curves: ClassVar[tuple[str, ...]] = ()

    @property
    def corners(self) -> int:
        """The most corners that it is traced with."""
        return sum(1 + int(MOST) * element.is_obstacle for element in self.elements)

    @property
    def start(self) -> tuple[int, Array]:
        """The body that it starts in, and where there (3,)."""
        first = self.elements[0]
        assert isinstance(first, Point)
        return first.body, first.runs

    def items(self, places: Places) -> list[ForceRecord]:
        """What pulls, and the path."""
        most = together = 0
        ints, numbers, work = list[int](), list[float](), FIRST
        for element in self.elements:
            together = together + 1 if element.is_obstacle else 0
            most = max(most, together)
            link, own = element.packed(places)
            ints += int(element.is_obstacle), link, len(numbers), work
            numbers += own
            work += element.work
        head = ITEM.OWN, len(self.elements), work
        path = ForceRecord(
            "cable_path",
            (*head, *ints),
            tuple(numbers),
            room=work + solver_room(most),
            is_part=True,
        )
        return [ForceRecord("pull_cable", is_part=True), path]

    def found(self, mechanism: Mechanism, q: Array) -> Cable | None:
        """The same, which begins with what it is at a pose; None if it is none there."""
        state = mechanism.at(q)
        placements = [
            Placement(GROUND, state.transform(body)) for body in range(len(mechanism.bodies))
        ]
        _, path = self.items(Places(mechanism, {}, placements))
        ints, work = np.array([0] * ITEM.OWN + list(path.ints)), np.zeros(path.room)
        cable_path(ints, np.array(path.numbers), work, np.zeros(1), np.zeros(1), 0)
        if np.isnan(work[LENGTH]):
            return None
        kept = ints[ELEMENTS + KEPT :: ELEMENT_INTS].tolist()
        return Cable(
            tuple(
                replace(element, begin=work[place : place + TOUCH_NUMBERS].copy())
                if isinstance(element, Obstacle)
                else element
                for element, place in zip(self.elements, kept, strict=True)
            )
        )


@register_path(Scholz2015GeometryPath)
def read_cable(builder: ElementBuilder, owner: Any) -> Cable:
    """The elements of an owner's path.

    Raises:
        UnsupportedError: there is an obstacle of a kind that a cable cannot run over.
        ModelError: the path does not begin and end with a point, or something makes no sense.
    """
    elements = tuple(
        _point(builder, item)
        if isinstance(item, Scholz2015GeometryPathPoint)
        else _obstacle(builder, owner, item)
        for item in owner.geometry_path.path_elements
    )
    if len(elements) < 2 or elements[0].is_obstacle or elements[-1].is_obstacle:
        raise ModelError(
            f"the path of '{builder.path(owner)}' does not begin and end with a point; let it"
        )
    # OpenSim finds it where the model is as it is written, and then assembled.
    written, assembled = builder.mechanism.values({}), builder.mechanism.default_state()[0]
    cable = Cable(elements).found(builder.mechanism, written)
    if cable and not np.array_equal(written, assembled):
        cable = cable.found(builder.mechanism, assembled)
    if cable is None:
        raise ModelError(
            f"the path of '{builder.path(owner)}' has no way over its obstacles where the model starts: a point or "
            "another obstacle is inside one, or a contact_hint leads nowhere; move them apart"
        )
    return cable


def check(builder: ElementBuilder, owner: Any) -> None:
    """Check whether OpenSim can lay a path over its obstacles, and name the point where one is inside.

    Raises: UnsupportedError: there is an obstacle of a kind that a cable cannot run over, and
        OpenSim may. ModelError: a point is inside an obstacle, a contact hint is where no point of
        the surface is nearest, or the search fails.
    """
    items = list(owner.geometry_path.path_elements)
    for index, item in enumerate(items):
        if isinstance(item, Scholz2015GeometryPathPoint):
            continue
        geometry = builder.target(item, "socket_contact_geometry", item.socket_contact_geometry)
        # OpenSim compares an obstacle with its neighbours, and with points beyond only if it
        # touches none between.
        for other in items[max(index - 1, 0) : index + 2]:
            if isinstance(other, Scholz2015GeometryPathPoint) and _is_enclosed(
                builder, other, geometry
            ):
                name = other.name or other.path_point.name
                raise ModelError(
                    f"the point '{name}' of the path of '{builder.path(owner)}' is inside the "
                    f"obstacle '{geometry.name}' where the model starts; move it out"
                )
    read_cable(builder, owner)


def _is_enclosed(builder: ElementBuilder, point_item: Any, geometry: ContactGeometry) -> bool:
    """Return whether a point of a path is inside an obstacle in a pose that OpenSim starts from."""
    mechanism = builder.mechanism
    poses = [mechanism.values({})]
    # Another rule reports constraints that no pose meets.
    with suppress(OsimliteError):
        poses.append(mechanism.default_state()[0])
    point = _point(builder, point_item)
    body, _ = builder.placement(builder.target(geometry, "socket_frame", geometry.socket_frame))
    surface = _surface(geometry)
    if surface is None and not isinstance(geometry, ContactHalfSpace):
        return False
    for q in poses:
        state = mechanism.at(q)
        frame = state.transform(body) @ make_offset(geometry.location, geometry.orientation)
        placed = state.transform(point.body) @ np.array([*point.runs, 1.0])
        x, y, z = (frame[:3, :3].T @ (placed[:3] - frame[:3, 3])).tolist()
        # A half-space is solid where x is positive.
        depth = x if surface is None else value(np.array(surface), (x, y, z))
        if depth > 0.0:
            return True
    return False


def _point(builder: ElementBuilder, item: Any) -> Point:
    point = item.path_point
    builder.check(point, point.location)
    body, frame = builder.placement(
        builder.target(point, "socket_parent_frame", point.socket_parent_frame)
    )
    runs = np.array(point.location)
    return Point(body, runs, frame[:3, :3] @ runs + frame[:3, 3])


def _obstacle(builder: ElementBuilder, owner: Any, item: Any) -> Obstacle:
    geometry = builder.target(item, "socket_contact_geometry", item.socket_contact_geometry)
    surface = _surface(geometry)
    if surface is None:
        raise builder.unsupported(owner, f" over the {kind_of(geometry)} '{geometry.name}'")
    builder.check(geometry, (*surface, *geometry.location, *geometry.orientation))
    if min(surface[1:3]) <= 0.0 or min(surface) < 0.0:
        raise ModelError(
            f"'{builder.path(geometry)}' has a size that is not positive; give it a positive one"
        )
    hint = np.array(item.contact_hint)
    has_hint = not np.isnan(hint).all()
    if has_hint:
        builder.check(item, hint.tolist())
    body, _ = builder.placement(builder.target(geometry, "socket_frame", geometry.socket_frame))
    begin = np.zeros(TOUCH_NUMBERS)
    begin[STATE] = LIFTED
    if has_hint:
        begin[STATE] = GUESSED
        begin[TRACKED : TRACKED + 3] = hint
        if _is_middle(surface, hint):
            raise ModelError(
                f"the contact_hint of the obstacle '{geometry.name}' of the path of '{builder.path(owner)}' is in the "
                "middle of the surface, so that no point of it is nearest; move it off the middle"
            )
        near = _nearest(surface, hint)
        for end in (START, END):
            begin[GEODESIC + end + POINT : GEODESIC + end + POINT + 3] = near
    begin[GEODESIC + STEP] = FIRST_STEP
    return Obstacle(body, make_offset(geometry.location, geometry.orientation), surface, begin)


def _surface(geometry: ContactGeometry) -> tuple[float, ...] | None:
    """The numbers of a surface."""
    if isinstance(geometry, ContactSphere):
        return SPHERE, geometry.radius, geometry.radius**2, 1.0, 1.0, 1.0
    if isinstance(geometry, ContactCylinder):
        return CYLINDER, geometry.radius, geometry.radius**2, 1.0, 1.0, 0.0
    if isinstance(geometry, ContactEllipsoid):
        return (
            ELLIPSOID,
            1.0,
            1.0,
            *(radius**-2 if radius > 0.0 else -1.0 for radius in geometry.radii),
        )
    if isinstance(geometry, ContactTorus):
        return TORUS, geometry.torus_radius, geometry.tube_radius, 0.0, 0.0, 0.0
    return None


def _is_middle(surface: tuple[float, ...], hint: Array) -> bool:
    """Return whether a surface has no normal through a point: its center, its axis, the ring in a torus."""
    kind, radius, _, *weights = surface
    if kind == TORUS:
        across = float(np.hypot(hint[0], hint[1]))
        return across == 0.0 or (across == radius and hint[2] == 0.0)
    return not (np.array(weights) * hint).any()


def _nearest(surface: tuple[float, ...], hint: Array) -> Array:
    """The point of a surface that is nearest to another one."""
    kind, radius, square, *weights = surface
    if kind == TORUS:
        ring = hint * (1.0, 1.0, 0.0)
        ring *= radius / np.linalg.norm(ring)
        return ring + square * (hint - ring) / np.linalg.norm(hint - ring)
    k = np.array(weights)
    # What is nearest is where x (1 + t k) = hint.
    t, nearest = 0.0, hint
    for _ in range(50):
        t += float((k @ nearest**2 - square) / (2.0 * (k**2 / (1.0 + t * k)) @ nearest**2))
        nearest = hint / (1.0 + t * k)
    return nearest
