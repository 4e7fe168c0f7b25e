"""From a mechanism and its forces to what the kernels work on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from osimlite.errors import UnsupportedError
from osimlite.multibody.functions import IDENTITY
from osimlite.multibody.joints import Mobilizer
from osimlite.multibody.mechanism import GROUND, Mechanism
from osimlite.multibody.motions import AxisMotion, Fixed, Motion, SphericalMotion
from osimlite.multibody.spatial import Array, inverse, rotation_about, skew, transform
from osimlite.simulation.contact_elements import HuntCrossley
from osimlite.simulation.elements import CoordinateLimit, Forces
from osimlite.simulation.kernels.arrays import (
    BALL,
    BALL_BACK,
    HALF_SPACE,
    MOVE,
    NOTHING,
    SHIFT,
    SLIDE,
    SPHERES,
    TURN,
    Numbers,
    Structure,
)
from osimlite.simulation.kernels.functions import function_table


@dataclass
class Packed:
    """A mechanism with its forces, packed.

    Attributes:
        order: place in the mechanism of the coordinate of each degree of freedom.
        placements: of every body its link (-1 for ground) and its frame (4, 4) in that.
    """

    structure: Structure
    numbers: Numbers
    order: tuple[int, ...]
    placements: list[tuple[int, Array]]


@dataclass
class _Operation:
    kind: int
    before: Array
    arguments: list[int]  # places in the mechanism
    function: Any = None
    radii: Array = field(default_factory=lambda: np.zeros(3))


@dataclass
class _Link:
    parent: int
    operations: list[_Operation]
    mass: float = 0.0
    first: Array = field(default_factory=lambda: np.zeros(3))  # first moment
    second: Array = field(default_factory=lambda: np.zeros((3, 3)))  # inertia about the link's origin


def pack(mechanism: Mechanism, forces: Forces) -> Packed:
    """Pack a mechanism and its forces.

    Raises:
        UnsupportedError: a joint, a function or a force that the kernels do not know.
    """
    links: list[_Link] = []
    placements: list[tuple[int, Array]] = []
    for body in mechanism.bodies:
        parent, frame = (GROUND, np.eye(4)) if body.parent == GROUND else placements[body.parent]
        operations, rest = _operations(mechanism, body.mobilizer, frame)
        if operations:
            links.append(_Link(parent, operations))
            parent = len(links) - 1
        placements.append((parent, rest))
        if parent != GROUND:
            _load(links[parent], body.mass_properties, rest)
    order: list[int] = []
    ends = [0]
    for link in links:
        own = {place for item in link.operations for place in item.arguments}
        order += sorted(place for place in own if not mechanism.coordinates[place].locked)
        ends.append(len(order))
    freedom = {place: number for number, place in enumerate(order)}
    structure, numbers = _arrays(mechanism, links, ends, freedom)
    pairs = [_pairs(element, placements) for element in forces.elements if isinstance(element, HuntCrossley)]
    limits = []
    for element in forces.elements:
        if isinstance(element, CoordinateLimit):
            limits.append(element)
        elif not isinstance(element, HuntCrossley):
            raise UnsupportedError(
                f"the compiled engine cannot compute '{element.path}' ({type(element).__name__}); "
                "take --engine bullet, or leave the force out"
            )
    rows = [row for group in pairs for row in group]
    limits = [item for item in limits if item.coordinate in freedom]
    structure = structure._replace(
        pair_kind=_ints([kind for kind, _, _ in rows]),
        pair_links=_ints([ends for _, ends, _ in rows]).reshape(-1, 2),
        limited=_ints([freedom[item.coordinate] for item in limits]),
    )
    numbers = numbers._replace(
        pairs=np.array([row for _, _, row in rows], dtype=float).reshape(-1, 18),
        limits=np.array([item.constants for item in limits], dtype=float).reshape(-1, 6),
    )
    return Packed(structure, numbers, tuple(order), placements)


def _operations(mechanism: Mechanism, mobilizer: Mobilizer, frame: Array) -> tuple[list[_Operation], Array]:
    """The motions of a joint from a frame of the carrying link on, and the carried body after the last of them."""
    own = mobilizer.coordinates
    chain: list[Motion] = [Fixed(mobilizer.parent_frame), *mobilizer.motions, Fixed(inverse(mobilizer.child_frame))]
    if mobilizer.reversed:
        chain.reverse()
    found: list[_Operation] = []
    for motion in chain:
        places = [own[number] for number in motion.coordinates]
        still = [mechanism.coordinates[place].locked for place in places]
        if isinstance(motion, Fixed):
            frame = frame @ (inverse(motion.matrix) if mobilizer.reversed else motion.matrix)
        elif all(still):
            q = np.zeros(len(own))
            q[list(motion.coordinates)] = [mechanism.coordinates[place].default_value for place in places]
            matrix = motion.relative(q, np.zeros(len(own))).matrix
            frame = frame @ (inverse(matrix) if mobilizer.reversed else matrix)
        elif isinstance(motion, AxisMotion):
            axis = -motion.axis if mobilizer.reversed else motion.axis
            turned = transform(_to_axis(axis))
            kind = TURN if motion.kind == "rotate" else SLIDE
            function = None if motion.function == IDENTITY else motion.function
            found.append(_Operation(kind, frame @ turned, places, function))
            frame = inverse(turned)
        elif isinstance(motion, SphericalMotion):
            if any(still):
                raise UnsupportedError(
                    f"'{mobilizer.joint}' ({mobilizer.joint_type}) has locked and free coordinates, which the "
                    "simulation cannot do; lock all of them or none"
                )
            kind = BALL_BACK if mobilizer.reversed else BALL
            found.append(_Operation(kind, frame, places, radii=motion.radii))
            frame = np.eye(4)
        else:
            raise UnsupportedError(
                f"the compiled engine cannot compute the {type(motion).__name__} of '{mobilizer.joint}'; "
                "take --engine bullet"
            )
    return found, frame


def _to_axis(axis: Array) -> Array:
    """A rotation (3, 3) that takes z to a unit vector; without rounding if that is a coordinate axis."""
    x, y, z = axis.tolist()
    if z == 1.0:
        return np.eye(3)
    if abs(x) == 1.0 or abs(y) == 1.0 or z == -1.0:
        other = np.array((abs(y), abs(z), abs(x)))
        return np.column_stack((other, np.cross(axis, other), axis))
    angle = float(np.arctan2(np.hypot(x, y), z))
    return rotation_about(np.array((-y, x, 0.0)) / np.hypot(x, y), angle)


def _load(link: _Link, properties: Any, frame: Array) -> None:
    """Add the mass of a body to its link."""
    rotation = frame[:3, :3]
    center = rotation @ properties.center + frame[:3, 3]
    link.mass += properties.mass
    link.first = link.first + properties.mass * center
    link.second = link.second + rotation @ properties.inertia @ rotation.T - properties.mass * _square(center)


def _square(v: Array) -> Array:
    """[v] [v], the inertia of a unit mass at v but for the sign."""
    matrix: Array = skew(v) @ skew(v)
    return matrix


def _inertia(link: _Link) -> list[float]:
    center = link.first / link.mass if link.mass != 0.0 else link.first
    i = link.second + link.mass * _square(center)
    return [link.mass, *center.tolist(), i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]


def _arrays(
    mechanism: Mechanism, links: Sequence[_Link], ends: list[int], freedom: dict[int, int]
) -> tuple[Structure, Numbers]:
    """Everything but the forces."""
    operations = [item for link in links for item in link.operations]
    above, carrying = [-1] * len(freedom), [-1] * len(links)
    for number, link in enumerate(links):
        last = carrying[link.parent] if link.parent >= 0 else -1
        for place in range(ends[number], ends[number + 1]):
            above[place], last = last, place
        carrying[number] = last
    places = [place for item in operations for place in item.arguments]
    tables = [
        function_table(item.function, mechanism.coordinates[item.arguments[0]].joint)
        for item in operations
        if item.function is not None
    ]
    numbered = iter(range(len(tables)))
    structure = Structure(
        parent=_ints([link.parent for link in links]),
        operations=_ints(np.cumsum([0, *(len(link.operations) for link in links)])),
        freedoms=_ints(ends),
        kind=_ints([item.kind for item in operations]),
        before=_ints([_kind_of(item.before) for item in operations]),
        function=_ints([-1 if item.function is None else next(numbered) for item in operations]),
        first_argument=_ints(np.cumsum([0, *(len(item.arguments) for item in operations)])),
        arguments=_ints([freedom.get(place, -1) for place in places]),
        above=_ints(above),
        function_kind=_ints([kind for kind, _ in tables]),
        function_start=_ints(np.cumsum([0, *(len(table) for _, table in tables)])),
        pair_kind=_ints([]),
        pair_links=_ints([]).reshape(-1, 2),
        limited=_ints([]),
    )
    fixed = [[*item.before[:3, :3].ravel().tolist(), *item.before[:3, 3].tolist()] for item in operations]
    numbers = Numbers(
        gravity=np.array(mechanism.gravity, dtype=float),
        fixed=np.array(fixed, dtype=float).reshape(-1, 12),
        radii=np.array([item.radii for item in operations], dtype=float).reshape(-1, 3),
        inertia=np.array([_inertia(link) for link in links], dtype=float).reshape(-1, 10),
        constants=np.array([mechanism.coordinates[place].default_value for place in places], dtype=float),
        table=np.array([x for _, table in tables for x in table], dtype=float),
        pairs=np.zeros((0, 18)),
        limits=np.zeros((0, 6)),
    )
    return structure, numbers


def _kind_of(matrix: Array) -> int:
    if not np.array_equal(matrix[:3, :3], np.eye(3)):
        return MOVE
    return SHIFT if matrix[:3, 3].any() else NOTHING


def _pairs(
    element: HuntCrossley, placements: Sequence[tuple[int, Array]]
) -> list[tuple[int, tuple[int, int], list[float]]]:
    """Kind, links and numbers of every pair of surfaces."""
    if element.early_return:
        raise UnsupportedError(
            f"the compiled engine does not reproduce Simbody's early return in '{element.path}'; take --engine bullet"
        )
    found = []
    for pair in element.pairs:
        one, two = element.surfaces[pair.first], element.surfaces[pair.second]
        row: list[float] = []
        links = []
        for surface in (one, two):
            link, frame = placements[surface.body] if surface.body != GROUND else (GROUND, np.eye(4))
            links.append(link)
            center = frame[:3, :3] @ np.array(surface.center) + frame[:3, 3]
            normal = frame[:3, :3] @ np.array(surface.normal)
            row += center.tolist()
            if surface is one:
                row += [*normal.tolist(), 0.0 if surface.is_half_space else surface.radius]
            else:
                row.append(surface.radius)
        row += [*pair.effective, element.vt]
        found.append((HALF_SPACE if one.is_half_space else SPHERES, (links[0], links[1]), row))
    return found


def _ints(values: Any) -> Any:
    return np.array(values, dtype=np.int64)
