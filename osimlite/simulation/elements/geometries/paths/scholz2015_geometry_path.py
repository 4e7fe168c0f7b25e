"""Cables: paths through points and over obstacles that they may touch (Scholz et al. 2015).

OpenSim passes the locations of points and surfaces to Simbody as if their frames were those of the
bodies; only forces at points are applied in the right place. This module reproduces that.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any, ClassVar

import numpy as np

from osimlite.base.records import dataclass, replace
from osimlite.base.text import add_article
from osimlite.errors import ModelError, OsimliteError, UnsupportedError
from osimlite.mechanics.kernels.cable_correction import solver_size
from osimlite.mechanics.kernels.cable_records import (
    CABLE,
    CABLE_POINT_WORK,
    CABLE_WORK,
    ELEMENT,
    OBSTACLE_STATE,
    OBSTACLE_WORK,
)
from osimlite.mechanics.kernels.cable_surfaces import (
    END_NUMBERS,
    GEODESIC,
    SURFACE_TYPE,
    surface_value,
)
from osimlite.mechanics.kernels.layout import ITEM
from osimlite.mechanics.kernels.wrap_curves import MAX_SEGMENTS
from osimlite.mechanics.multibody.links import LinkMap, Placement
from osimlite.mechanics.multibody.mechanism import GROUND, Mechanism
from osimlite.mechanics.multibody.spatial import Array, make_offset
from osimlite.schema.contact import ContactGeometry
from osimlite.schema.contact_types import (
    ContactCylinder,
    ContactEllipsoid,
    ContactHalfSpace,
    ContactSphere,
    ContactTorus,
)
from osimlite.schema.scholz_paths import Scholz2015GeometryPath, Scholz2015GeometryPathPoint
from osimlite.simulation.elements.builder import ElementBuilder, get_class_name
from osimlite.simulation.elements.force_records import ForceRecord
from osimlite.simulation.elements.registry import register_path

FIRST_STEP = 1e-10
"""First step of the integration of a geodesic, m."""


@dataclass(frozen=True, eq=False)
class CablePoint:
    """Point of a cable.

    Attributes:
        body: index of the body with the point.
        runs: station in the body that the cable runs through, m.
        pulls: station in the body at which the force acts, m.
    """

    body: int
    runs: Array
    pulls: Array

    size: ClassVar[int] = CABLE_POINT_WORK.SIZE
    is_obstacle: ClassVar[bool] = False

    def pack(self, link_map: LinkMap) -> tuple[int, list[float]]:
        """Return the link of the point and its numbers.

        Args:
            link_map: placement of the bodies in the links of the tree.

        Returns:
            Index of the link, and the stations of the cable and of its force in the link, m.
        """
        link, runs = link_map.station(self.body, self.runs.tolist())
        _, pulls = link_map.station(self.body, self.pulls.tolist())
        return link, [*runs, *pulls]


@dataclass(frozen=True, eq=False)
class CableObstacle:
    """Surface that a cable may touch.

    Attributes:
        body: index of the body with the obstacle.
        frame: placement (4, 4) of the surface in the body.
        surface: numbers of the surface.
        begin: initial guess of the contact with the cable.
    """

    body: int
    frame: Array
    surface: tuple[float, ...]
    begin: Array

    size: ClassVar[int] = OBSTACLE_WORK.SIZE
    is_obstacle: ClassVar[bool] = True

    def pack(self, link_map: LinkMap) -> tuple[int, list[float]]:
        """Return the link of the obstacle and its numbers.

        Args:
            link_map: placement of the bodies in the links of the tree.

        Returns:
            Index of the link, and placement, initial contact and shape of the surface.
        """
        link, body_in_link = link_map.placement(self.body)
        frame = body_in_link @ self.frame
        return link, [
            *frame[:3, :3].ravel().tolist(),
            *frame[:3, 3].tolist(),
            *self.begin.tolist(),
            *self.surface,
        ]


@dataclass(frozen=True)
class Cable:
    """Path over obstacles.

    Attributes:
        elements: points and obstacles in the order of the path.
    """

    elements: tuple[CablePoint | CableObstacle, ...]

    coupled: ClassVar[bool] = True
    trace: ClassVar[str] = "trace_cable"
    curves: ClassVar[tuple[str, ...]] = ()

    @property
    def corners(self) -> int:
        """Maximum number of corners of its polyline."""
        return sum(1 + int(MAX_SEGMENTS) * element.is_obstacle for element in self.elements)

    @property
    def start(self) -> tuple[int, Array]:
        """Start of the cable.

        Returns:
            The body of the first point, and the point's position in it (3,), m.
        """
        first = self.elements[0]
        assert isinstance(first, CablePoint)
        return first.body, first.runs

    def make_records(self, link_map: LinkMap) -> list[ForceRecord]:
        """Return the record that pulls, and that of the cable.

        Args:
            link_map: placement of the bodies in the links of the tree.
        """
        longest_run = run_length = 0
        ints = list[int]()
        numbers = list[float]()
        work = CABLE_WORK.FIRST
        for element in self.elements:
            # The solver couples obstacles between two points, so its size follows from the longest
            # run of obstacles.
            run_length = run_length + 1 if element.is_obstacle else 0
            longest_run = max(longest_run, run_length)
            link, element_numbers = element.pack(link_map)
            ints += int(element.is_obstacle), link, len(numbers), work
            numbers += element_numbers
            work += element.size
        head = ITEM.DETAILS, len(self.elements), work
        path = ForceRecord(
            "cable_path",
            (*head, *ints),
            tuple(numbers),
            record_size=work + solver_size(longest_run),
            is_part=True,
        )
        return [ForceRecord("pull_cable", is_part=True), path]

    def solve_at(self, mechanism: Mechanism, q: Array) -> Cable | None:
        """Return the cable that starts from its solution in a pose.

        Args:
            mechanism: the mechanism.
            q: values of the coordinates, rad or m.

        Returns:
            The cable with new initial guesses; None if there is no solution.
        """
        state = mechanism.at(q)
        placements = [
            Placement(GROUND, state.transform(body)) for body in range(len(mechanism.bodies))
        ]
        _, path = self.make_records(LinkMap(mechanism, {}, placements))
        ints = np.array([0] * ITEM.DETAILS + list(path.ints))
        work = np.zeros(path.record_size)
        # Only cables need the engines while a model is built. As Python the search takes seconds.
        from osimlite.simulation.engines.linking import READY_CODE

        find_path = READY_CODE.select_for([path.kernel]).get_entry(path.kernel)
        try:
            find_path(ints, np.array(path.numbers), work, np.zeros(1), np.zeros(1), 0)
        except ArithmeticError:
            # As Python, kernels raise where machine code gets NaN: a path that is normal to a plane
            # at its hint has no direction on it.
            return None
        # Machine code continues with NaN where Python raises. If the cable then leaves the obstacle,
        # its length is a number, but the record of the obstacle is not.
        if np.isnan(work).any():
            return None
        saved_offsets = ints[CABLE.ELEMENTS + ELEMENT.RECORD :: ELEMENT.SIZE].tolist()
        return Cable(
            tuple(
                replace(element, begin=work[offset : offset + OBSTACLE_WORK.TOUCH_SIZE].copy())
                if isinstance(element, CableObstacle)
                else element
                for element, offset in zip(self.elements, saved_offsets, strict=True)
            )
        )


@register_path(Scholz2015GeometryPath)
def read_cable(builder: ElementBuilder, owner: Any) -> Cable:
    """Return the cable of an owner's path, solved in the default pose.

    Args:
        builder: builder of the model's elements.
        owner: component with the path.

    Raises:
        ModelError: the path does not begin and end with a point, a cable cannot run over an obstacle
            of this class, a parameter has no meaning, or no path over the obstacles is found.
        UnsupportedError: the radius of an obstacle is not positive.
    """
    elements = tuple(
        _read_point(builder, item)
        if isinstance(item, Scholz2015GeometryPathPoint)
        else _read_obstacle(builder, owner, item)
        for item in owner.geometry_path.path_elements
    )
    if len(elements) < 2 or elements[0].is_obstacle or elements[-1].is_obstacle:
        raise ModelError(
            f"the path of '{builder.path(owner)}' must begin and end with a point; add the missing one"
        )
    # OpenSim solves it in the written default pose, and again after the assembly.
    written = builder.mechanism.values({})
    assembled = builder.mechanism.default_state()[0]
    cable = Cable(elements).solve_at(builder.mechanism, written)
    if cable and not np.array_equal(written, assembled):
        cable = cable.solve_at(builder.mechanism, assembled)
    if cable is None:
        raise ModelError(
            f"the path of '{builder.path(owner)}' cannot be wrapped over its obstacles in the default pose: a point or "
            "obstacle is inside another obstacle, or a contact_hint is unsuitable; move the parts apart, or change the hint"
        )
    return cable


def check_cable(builder: ElementBuilder, owner: Any) -> None:
    """Check whether OpenSim can lay a path over its obstacles, and name a point that is inside one.

    Args:
        builder: builder of the model's elements.
        owner: component with the path.

    Raises:
        ModelError: a point is inside an obstacle, an obstacle is a mesh, a contact hint has no
            nearest point on the surface, or the search fails.
    """
    items = list(owner.geometry_path.path_elements)
    for index, item in enumerate(items):
        if isinstance(item, Scholz2015GeometryPathPoint):
            continue
        geometry = builder.resolve_target(
            item, "socket_contact_geometry", item.socket_contact_geometry
        )
        # OpenSim compares an obstacle with its neighbours; it reaches points beyond them only if the
        # cable touches no obstacle between.
        for other in items[max(index - 1, 0) : index + 2]:
            if isinstance(other, Scholz2015GeometryPathPoint) and _is_enclosed(
                builder, other, geometry
            ):
                name = other.name or other.path_point.name
                raise ModelError(
                    f"the point '{name}' of the path of '{builder.path(owner)}' is inside the "
                    f"obstacle '{geometry.name}' in the default pose; move it out"
                )
    read_cable(builder, owner)


def _is_enclosed(builder: ElementBuilder, point_item: Any, geometry: ContactGeometry) -> bool:
    """Return whether a point of a path is inside an obstacle in a pose that OpenSim starts from.

    Args:
        builder: builder of the model's elements.
        point_item: the point.
        geometry: surface of the obstacle.
    """
    mechanism = builder.mechanism
    poses = [mechanism.values({})]
    # Another rule reports constraints that no pose satisfies.
    with suppress(OsimliteError):
        poses.append(mechanism.default_state()[0])
    point = _read_point(builder, point_item)
    body, _ = builder.find_placement(
        builder.resolve_target(geometry, "socket_frame", geometry.socket_frame)
    )
    surface = _list_surface_numbers(geometry)
    if surface is None:
        return False
    for q in poses:
        state = mechanism.at(q)
        frame = state.transform(body) @ make_offset(geometry.location, geometry.orientation)
        position = state.transform(point.body) @ np.array([*point.runs, 1.0])
        x, y, z = (frame[:3, :3].T @ (position[:3] - frame[:3, 3])).tolist()
        if surface_value(np.array(surface), (x, y, z)) > 0.0:
            return True
    return False


def _read_point(builder: ElementBuilder, item: Any) -> CablePoint:
    point = item.path_point
    builder.check_finite(point, point.location)
    body, frame = builder.find_placement(
        builder.resolve_target(point, "socket_parent_frame", point.socket_parent_frame)
    )
    runs = np.array(point.location)
    return CablePoint(body, runs, frame[:3, :3] @ runs + frame[:3, 3])


def _read_obstacle(builder: ElementBuilder, owner: Any, item: Any) -> CableObstacle:
    geometry = builder.resolve_target(item, "socket_contact_geometry", item.socket_contact_geometry)
    surface = _list_surface_numbers(geometry)
    if surface is None:
        # OpenSim asks each obstacle for the equation of its surface, which meshes do not have.
        raise ModelError(
            f"the obstacle '{geometry.name}' of the path of '{builder.path(owner)}' is "
            f"{add_article(get_class_name(geometry))}, which osimlite does not support as an obstacle; use a sphere, cylinder, "
            "ellipsoid, torus or half-space"
        )
    builder.check_finite(geometry, (*surface, *geometry.location, *geometry.orientation))
    _check_size(builder, geometry, surface)
    hint = np.array(item.contact_hint)
    has_hint = not np.isnan(hint).all()
    if has_hint:
        builder.check_finite(item, hint.tolist())
    body, _ = builder.find_placement(
        builder.resolve_target(geometry, "socket_frame", geometry.socket_frame)
    )
    begin = np.zeros(OBSTACLE_WORK.TOUCH_SIZE)
    begin[OBSTACLE_WORK.STATE] = OBSTACLE_STATE.LIFTED
    if has_hint:
        begin[OBSTACLE_WORK.STATE] = OBSTACLE_STATE.GUESSED
        begin[OBSTACLE_WORK.TRACKED : OBSTACLE_WORK.TRACKED + 3] = hint
        if _is_middle(surface, hint):
            raise ModelError(
                f"the contact_hint of the obstacle '{geometry.name}' of the path of '{builder.path(owner)}' is in the "
                "middle of the surface, so no point of the surface is nearest to it; move the hint away from the middle"
            )
        nearest_point = _find_nearest_point(surface, hint)
        for end in (GEODESIC.START, GEODESIC.END):
            begin[
                OBSTACLE_WORK.CURVE + end + END_NUMBERS.POINT : OBSTACLE_WORK.CURVE
                + end
                + END_NUMBERS.POINT
                + 3
            ] = nearest_point
    begin[OBSTACLE_WORK.CURVE + GEODESIC.STEP] = FIRST_STEP
    return CableObstacle(body, make_offset(geometry.location, geometry.orientation), surface, begin)


def _check_size(
    builder: ElementBuilder, geometry: ContactGeometry, surface: tuple[float, ...]
) -> None:
    """Check whether the sizes of an obstacle make a surface, as OpenSim 4.6 decides it (measured).

    It takes the absolute value of half axes and of the radius of a tube; a ring of radius 0 is a
    sphere.

    Raises:
        ModelError: OpenSim finds no path over such a surface.
        UnsupportedError: the radius is not positive: OpenSim may find a path, which has no meaning.
    """
    if isinstance(geometry, ContactSphere | ContactCylinder) and geometry.radius <= 0.0:
        raise UnsupportedError(
            f"'{builder.path(geometry)}' has a radius that is not positive, so no path can wrap "
            "around it; give a positive radius"
        )
    if isinstance(geometry, ContactTorus):
        is_surface = geometry.torus_radius >= 0.0 and geometry.tube_radius != 0.0
    else:
        is_surface = min(surface[1:3]) > 0.0 and min(surface) >= 0.0
    if not is_surface:
        raise ModelError(
            f"'{builder.path(geometry)}' has a size that is not positive; give a positive size"
        )


def _list_surface_numbers(geometry: ContactGeometry) -> tuple[float, ...] | None:
    """Return the numbers of a surface for the kernels of cables.

    Args:
        geometry: the contact geometry.

    Returns:
        Kind, two sizes (m, m²) and three weights, see
        :mod:`osimlite.mechanics.kernels.cable_surfaces`; None if a cable cannot run over it.
    """
    if isinstance(geometry, ContactSphere):
        return SURFACE_TYPE.SPHERE, geometry.radius, geometry.radius**2, 1.0, 1.0, 1.0
    if isinstance(geometry, ContactCylinder):
        return SURFACE_TYPE.CYLINDER, geometry.radius, geometry.radius**2, 1.0, 1.0, 0.0
    if isinstance(geometry, ContactEllipsoid):
        return (
            SURFACE_TYPE.ELLIPSOID,
            1.0,
            1.0,
            *(radius**-2 if radius != 0.0 else -1.0 for radius in geometry.radii),
        )
    if isinstance(geometry, ContactTorus):
        return SURFACE_TYPE.TORUS, geometry.torus_radius, geometry.tube_radius, 0.0, 0.0, 0.0
    if isinstance(geometry, ContactHalfSpace):
        # The numbers of its size are not used; its weights of 0 leave it without curvature.
        return SURFACE_TYPE.PLANE, 1.0, 1.0, 0.0, 0.0, 0.0
    return None


def _is_middle(surface: tuple[float, ...], hint: Array) -> bool:
    """Return whether a surface has no normal through a point: its center, its axis, the ring in a torus.

    Args:
        surface: numbers of the surface.
        hint: the point (3,) in the frame of the surface, m.
    """
    kind, radius, _, *weights = surface
    if kind == SURFACE_TYPE.TORUS:
        across = float(np.hypot(hint[0], hint[1]))
        return across == 0.0 or (across == radius and hint[2] == 0.0)
    return kind != SURFACE_TYPE.PLANE and not (np.array(weights) * hint).any()


def _find_nearest_point(surface: tuple[float, ...], hint: Array) -> Array:
    """Return the point of a surface that is nearest to another point.

    Args:
        surface: numbers of the surface.
        hint: the other point (3,) in the frame of the surface, m.

    Returns:
        The nearest point (3,), m.
    """
    kind, radius, square, *weights = surface
    if kind == SURFACE_TYPE.TORUS:
        ring = hint * (1.0, 1.0, 0.0)
        ring *= radius / np.linalg.norm(ring)
        return ring + square * (hint - ring) / np.linalg.norm(hint - ring)
    if kind == SURFACE_TYPE.PLANE:
        return hint * (0.0, 1.0, 1.0)
    k = np.array(weights)
    # The nearest point x satisfies x (1 + t k) = hint.
    t, nearest = 0.0, hint
    # Newton's method for the multiplier t.
    for _ in range(50):
        t += float((k @ nearest**2 - square) / (2.0 * (k**2 / (1.0 + t * k)) @ nearest**2))
        nearest = hint / (1.0 + t * k)
    return nearest
