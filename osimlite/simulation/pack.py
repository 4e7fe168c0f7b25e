"""From a mechanism and its forces to the vectors that the kernels work on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from osimlite.errors import UnsupportedError
from osimlite.kernels.curves_abreast import LANES, ROWS
from osimlite.kernels.functions import ARC, MONOMIALS, MONOMIALS_OF_OPENSIM
from osimlite.kernels.layout import (
    CONSTRAINED,
    CONTACT_WORK,
    ITEM,
    LINK_WORK,
    MODEL,
    MOTION,
    OPERATION,
    OPERATION_WORK,
    TRANSFORM,
    WORK,
)
from osimlite.kernels.pointers import Floats, Ints
from osimlite.kernels.record import STATES
from osimlite.kernels.table import LAW_NUMBERS
from osimlite.multibody.constraints import Constraint
from osimlite.multibody.function_tables import function_table
from osimlite.multibody.functions import IDENTITY
from osimlite.multibody.joints import Mobilizer
from osimlite.multibody.mechanism import GROUND, Mechanism
from osimlite.multibody.motions import AxisMotion, Fixed, Motion, SimbodyAccelerationError, SphericalMotion
from osimlite.multibody.spatial import Array, inverse, rotation_about, skew, transform
from osimlite.records import dataclass, field
from osimlite.simulation.constrained import constraints_on, free_coordinates
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.items import CONTROLS, ForceElement, Placement, Places, Response
from osimlite.simulation.pack_constraints import constraint_record, room_for
from osimlite.simulation.states import StateLayout

if TYPE_CHECKING:
    from osimlite.simulation.pack_chain import Chain

LAWS_OF_FUNCTIONS = {
    MONOMIALS: "amount_by_several",
    MONOMIALS_OF_OPENSIM: "amount_by_several",
    ARC: "amount_by_arc",
}
"""The law of each kind of function that takes several coordinates."""
FEWEST = 8
"""Items that follow one another and are worth a kernel of their own."""


@dataclass
class Packed:
    """A mechanism with its forces, packed."""

    structure: Ints  # the integers, with no addresses in them
    numbers: Floats  # the numbers
    laws: tuple[str, ...]  # names of the engine's own functions that must be there
    # by place in the structure what computes an item: a name, or a function of Python
    kernels: dict[int, str | Callable[..., None]]
    equilibria: dict[int, str]  # by place in the structure the name of what brings an item into equilibrium
    responses: dict[int, str]  # by place in the structure the name of what finds the derivatives of an item
    runs: dict[int, str]  # by place in the structure the name of what computes several items at once
    owners: dict[int, int]  # by place in the structure of an item the number of its force element
    order: tuple[int, ...]  # place in the mechanism of the coordinate of each degree of freedom
    placements: list[Placement]  # of every body its link (-1 for ground) and its frame in that
    # of every force element the records of its items in the work vector, as place and length
    items: list[list[tuple[int, int]]]


@dataclass
class _Operation:
    kind: int
    before: Array
    arguments: list[int]  # places in the mechanism
    function: Any = None
    radii: Array = field(default_factory=lambda: np.zeros(3))
    axis: Array = field(default_factory=lambda: np.array((0.0, 0.0, 1.0)))  # of a slide
    turns: list[_Operation | None] = field(default_factory=list)  # of a drift
    looked_at: list[int] = field(default_factory=list)  # by a drift: its sign, and two places in the mechanism
    joint: str = ""


@dataclass
class _Link:
    parent: int
    operations: list[_Operation]
    mass: float = 0.0
    first: Array = field(default_factory=lambda: np.zeros(3))  # first moment
    second: Array = field(default_factory=lambda: np.zeros((3, 3)))  # inertia about the link's origin


def pack(mechanism: Mechanism, forces: Forces, chain: Chain | None = None, *, apart: bool = False) -> Packed:
    """Pack a mechanism and its forces.

    Args:
        mechanism: what moves.
        forces: what pushes it, besides gravity.
        chain: of joints whose mass matrix another program computes; the kernels do without one.
        apart: whether bodies that never move in one another are links of their own.

    Raises:
        UnsupportedError: a joint, a function, a constraint or a force that the kernels do not know.
    """
    links: list[_Link] = []
    placements: list[Placement] = []
    free = set(free_coordinates(mechanism))
    for body in mechanism.bodies:
        parent, frame = (GROUND, np.eye(4)) if body.parent == GROUND else placements[body.parent]
        operations, rest = _operations(mechanism, body.mobilizer, frame, free)
        if operations or apart:
            links.append(_Link(parent, operations))
            parent = len(links) - 1
        placements.append(Placement(parent, rest))
        if parent != GROUND:
            _load(links[parent], body.mass_properties, rest)
    order: list[int] = []
    ends = [0]
    for link in links:
        own = {place for item in link.operations for place in item.arguments}
        order += sorted(own & free)
        ends.append(len(order))
    places = Places(mechanism, {place: number for number, place in enumerate(order)}, placements)
    state = StateLayout(mechanism, order, forces.elements)
    return Packer(places, links, ends, forces, state, chain).packed(tuple(order))


def _operations(
    mechanism: Mechanism, mobilizer: Mobilizer, frame: Array, free: set[int]
) -> tuple[list[_Operation], Array]:
    """The motions of a joint from a frame of the carrying link on, and the carried body after the last of them."""
    own = mobilizer.coordinates
    chain: list[Motion] = [Fixed(mobilizer.parent_frame), *mobilizer.motions, Fixed(inverse(mobilizer.child_frame))]
    if mobilizer.reversed:
        chain.reverse()
    result: list[_Operation] = []
    of_motion: dict[int, _Operation] = {}
    drifts: list[tuple[_Operation, SimbodyAccelerationError]] = []
    for motion in chain:
        places = [own[number] for number in motion.coordinates]
        still = free.isdisjoint(places)
        if isinstance(motion, Fixed):
            frame = frame @ (inverse(motion.matrix) if mobilizer.reversed else motion.matrix)
        elif isinstance(motion, SimbodyAccelerationError):
            if motion.elementary() and not free.isdisjoint(own):
                sign = -1 if mobilizer.reversed else 1
                result.append(_Operation(MOTION.ACCELERATION_ERROR, frame, [], looked_at=[sign, *own[:2]]))
                drifts.append((result[-1], motion))
                frame = np.eye(4)
        elif still:
            q = np.zeros(len(own))
            q[list(motion.coordinates)] = [mechanism.coordinates[place].default_value for place in places]
            matrix = motion.relative(q, np.zeros(len(own))).matrix
            frame = frame @ (inverse(matrix) if mobilizer.reversed else matrix)
        elif isinstance(motion, AxisMotion):
            axis = -motion.axis if mobilizer.reversed else motion.axis
            function = None if motion.function == IDENTITY else motion.function
            if motion.kind == "rotate":
                turned = transform(_to_axis(axis))
                result.append(_Operation(MOTION.TURN, frame @ turned, places, function))
                of_motion[id(motion)] = result[-1]
                frame = inverse(turned)
            else:
                result.append(_Operation(MOTION.SLIDE, frame, places, function, axis=axis))
                frame = np.eye(4)
        elif isinstance(motion, SphericalMotion):
            kind = MOTION.BALL_BACK if mobilizer.reversed else MOTION.BALL
            result.append(_Operation(kind, frame, places, radii=motion.radii))
            frame = np.eye(4)
        else:
            raise UnsupportedError(f"the {type(motion).__name__} of '{mobilizer.joint}' cannot be computed")
    for operation in result:
        operation.joint = mobilizer.joint
    for operation, drift in drifts:
        operation.turns = [of_motion.get(id(turn)) for turn in drift.turns]
    return result, frame


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
    return skew(v) @ skew(v)


def _inertia(link: _Link) -> list[float]:
    center = link.first / link.mass if link.mass != 0.0 else link.first
    i = link.second + link.mass * _square(center)
    return [link.mass, *center.tolist(), i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]


class Packer:
    """Puts everything at its place in the vectors."""

    def __init__(
        self,
        places: Places,
        links: list[_Link],
        ends: list[int],
        forces: Forces,
        state: StateLayout,
        chain: Chain | None,
    ) -> None:
        self.chain = chain
        self.places = places
        self.links = links
        self.ends = ends
        self.elements: Sequence[ForceElement] = forces.elements
        self.controls = forces.controls
        self.state = state
        self.operations = [operation for link in links for operation in link.operations]
        self.ints: list[int] = [0] * (MODEL.LAWS + len(LAW_NUMBERS))
        self.numbers: list[float] = [float(x) for x in places.mechanism.gravity]
        self.work = WORK.SIZE
        self.entries = 0
        self.balls: dict[tuple[int, ...], int] = {}
        self.laws: list[str] = ["evaluate"]
        self.kernels: dict[int, str | Callable[..., None]] = {}
        self.equilibria: dict[int, str] = {}
        self.responses: dict[int, str] = {}
        self.owners: dict[int, int] = {}
        self.runs: dict[int, str] = {}

    def packed(self, order: tuple[int, ...]) -> Packed:
        """Everything."""
        ints, size = self.ints, len(order)
        for link in self.links:
            self.numbers += _inertia(link)
        ints[MODEL.FIXED_AT] = len(self.numbers)
        for operation in self.operations:
            before = operation.before
            self.numbers += [*before[:3, :3].ravel().tolist(), *before[:3, 3].tolist(), *operation.axis.tolist()]
        ints[MODEL.LINKS], ints[MODEL.DOFS] = len(self.links), size
        ints[MODEL.WORK_LINK] = self.room(LINK_WORK.SIZE * len(self.links))
        ints[MODEL.WORK_OPERATION] = self.room(OPERATION_WORK.SIZE * len(self.operations))
        ints[MODEL.WORK_COLUMN], ints[MODEL.WORK_PIVOT] = self.room(6 * size), self.room(size)
        above = self.link_records()
        self.freedom_records(above)
        self.operation_records()
        self.constraint_records(*constraints_on(self.places.mechanism, order))
        if self.chain is not None:
            from osimlite.simulation.pack_chain import pack_chain

            pack_chain(self, self.chain)
        ints[MODEL.WORK_CONTROL] = self.room(len(self.controls.names))
        result = self.item_records()
        self.control_record()
        ints[MODEL.STATE_SIZE] = self.state.size
        ints[MODEL.WORK_STATE] = self.room(ints[MODEL.STATE_SIZE] * STATES)
        ints[MODEL.WORK_SIZE] = self.work
        structure, numbers = np.array(ints, dtype=np.int64), np.array(self.numbers, dtype=np.float64)
        laws = tuple(dict.fromkeys(self.laws))
        asked = self.kernels, self.equilibria, self.responses, self.runs, self.owners
        return Packed(structure, numbers, laws, *asked, order, self.places.placements, result)

    def room(self, count: int) -> int:
        """Place of some more numbers in the work vector."""
        self.work += count
        return self.work - count

    def law(self, name: str) -> int:
        """Number of a law, which must then be there."""
        self.laws.append(name)
        return LAW_NUMBERS[name]

    def link_records(self) -> list[int]:
        """Write the links; returns the degree of freedom above each."""
        self.ints[MODEL.LINK_AT] = len(self.ints)
        above, carrying, operation = [-1] * self.ends[-1], [-1] * len(self.links), 0
        for number, link in enumerate(self.links):
            first, end = self.ends[number], self.ends[number + 1]
            self.ints += [link.parent, operation, operation + len(link.operations), first, end]
            operation += len(link.operations)
            last = carrying[link.parent] if link.parent >= 0 else -1
            for freedom in range(first, end):
                above[freedom], last = last, freedom
            carrying[number] = last
        return above

    def freedom_records(self, above: Sequence[int]) -> None:
        """Write the degrees of freedom, and the list of those whose columns are sums."""
        self.ints[MODEL.DOF_AT] = len(self.ints)
        depths: list[int] = []
        for freedom in above:
            depths.append(depths[freedom] + 1 if freedom >= 0 else 0)
            self.ints += [freedom, self.room(depths[-1] + 1), depths[-1]]
            self.entries += depths[-1] + 1
        self.ints[MODEL.SUMMED_AT] = len(self.ints)
        summed = [number for number in range(len(above)) if not self.is_alone(number)]
        self.ints[MODEL.SUMMED] = len(summed)
        self.ints += summed

    def is_alone(self, freedom: int) -> bool:
        """Whether a degree of freedom is the amount of one operation, and nothing else."""
        users = [item for item in self.operations if freedom in map(self.places.freedom, item.arguments)]
        return len(users) == 1 and users[0].function is None and users[0].kind in (MOTION.TURN, MOTION.SLIDE)

    def operation_records(self) -> None:
        """Write the operations, and what their functions need."""
        start = self.ints[MODEL.OPERATION_AT] = len(self.ints)
        self.ints += [0] * (OPERATION.SIZE * len(self.operations))
        numbers = {id(item): number for number, item in enumerate(self.operations)}
        for number, item in enumerate(self.operations):
            freedom, law, gradient = -1, OPERATION.ALONE, 0
            extra = len(self.numbers)
            freedoms = [self.places.freedom(place) for place in item.arguments]
            looked_at: list[int] = []
            if item.kind == MOTION.ACCELERATION_ERROR:
                law = self.law("place_drift")
                self.law("move_drift")
                sign, *watched = item.looked_at
                looked_at = [sign, *(self.places.freedom(place) for place in watched), *[-1] * (2 - len(watched))]
                looked_at += [-1 if turn is None else numbers[id(turn)] for turn in item.turns]
            elif item.kind in (MOTION.BALL, MOTION.BALL_BACK):
                law = self.law("place_ball")
                self.law("move_ball")
                self.numbers += item.radii.tolist()
            elif item.function is None:
                freedom = freedoms[0]
                law = OPERATION.ALONE if self.is_alone(freedom) else OPERATION.TOGETHER
            else:
                infos = [self.places.mechanism.coordinates[place] for place in item.arguments]
                table = function_table(item.function, f"the function of an axis of the joint '{infos[0].joint}'")
                law = self.law(LAWS_OF_FUNCTIONS.get(int(table[0]), "amount_by_one"))
                self.numbers += [*(info.default_value for info in infos), *table]
                gradient = self.room(len(freedoms))
            arguments = len(self.ints)
            self.ints += [*freedoms, *looked_at]
            if item.kind in (MOTION.BALL, MOTION.BALL_BACK):
                self.balls[tuple(freedoms)] = arguments
            record = [item.kind, _kind_of(item.before), freedom, law, arguments, len(freedoms), extra, gradient]
            self.ints[start + OPERATION.SIZE * number : start + OPERATION.SIZE * (number + 1)] = record

    def constraint_records(self, kept: Sequence[Constraint], locks: int) -> None:
        """Write what constraints need, if there are any."""
        if not kept:
            return
        start, size = len(self.ints), self.ints[MODEL.DOFS]
        head = [0] * CONSTRAINED.SIZE
        self.ints[MODEL.CONSTRAINED] = start
        self.ints += head
        constraints = [constraint_record(item, self.places, self.balls) for item in kept]
        records: list[int] = []
        equations = 0
        for constraint in constraints:
            records.append(len(self.ints))
            end, end_position = equations + constraint.equations, equations + constraint.positions
            ints = [
                x + self.room(constraint.room) if k == constraint.room_at else x for k, x in enumerate(constraint.ints)
            ]
            self.ints += [self.law(constraint.law), len(self.numbers), equations, end, end_position, *ints]
            self.numbers += constraint.numbers
            equations = end
        head[CONSTRAINED.DYNAMICS], head[CONSTRAINED.PROJECT] = self.law("constrained_dynamics"), self.law("project")
        head[CONSTRAINED.FACTORISE], head[CONSTRAINED.MINIMUM_NORM] = (
            self.law("factorise_law"),
            self.law("minimum_norm_law"),
        )
        head[CONSTRAINED.CONSTRAINTS], head[CONSTRAINED.CONSTRAINT_AT] = len(constraints), len(self.ints)
        self.ints += records
        head[CONSTRAINED.BALLS], head[CONSTRAINED.BALL_AT] = len(self.balls), len(self.ints)
        self.ints += self.balls.values()
        head[CONSTRAINED.EQUATIONS], head[CONSTRAINED.POSITIONS] = (
            equations,
            sum(constraint.positions for constraint in constraints),
        )
        head[CONSTRAINED.LOCKS], head[CONSTRAINED.ENTRIES] = locks, self.entries
        for place, count in room_for(equations, size, self.entries).items():
            head[place] = self.room(count)
        self.ints[start : start + CONSTRAINED.SIZE] = head

    def item_records(self) -> list[list[tuple[int, int]]]:
        """Write the items; the records of the contacts come first, in their order."""
        groups = [element.items(self.places) for element in self.elements]
        self.ints[MODEL.CONTACTS] = sum(item.is_contact for group in groups for item in group)
        contact = self.ints[MODEL.WORK_CONTACT] = self.room(CONTACT_WORK.SIZE * self.ints[MODEL.CONTACTS])
        records: list[int] = []
        pairs: list[int] = []
        settling: dict[int, str] = {}
        responding: dict[int, Response] = {}
        runs: list[tuple[str, int]] = []
        result: list[list[tuple[int, int]]] = []
        places = {CONTROLS: self.ints[MODEL.WORK_CONTROL]}
        for owner, (element, group) in enumerate(zip(self.elements, groups, strict=True)):
            result.append([])
            first = len(pairs)
            for item in group:
                place = contact + CONTACT_WORK.SIZE * len(pairs) if item.is_contact else self.room(item.room)
                result[-1].append((place, CONTACT_WORK.SIZE if item.is_contact else item.room))
                if item.is_contact:
                    pairs.append(len(self.ints))
                if not item.is_part:
                    if not runs or runs[-1][0] != item.abreast:
                        runs.append((item.abreast, len(records)))
                    records.append(len(self.ints))
                self.kernels[len(self.ints)] = item.kernel if item.python is None else item.python
                self.owners[len(self.ints)] = owner
                if item.equilibrium:
                    settling[len(self.ints)] = item.equilibrium
                if item.response is not None:
                    responding[len(self.ints)] = item.response
                own = list(item.ints)
                for number, at_state in enumerate(item.states):
                    own[at_state] = self.state.first_of(element) + number
                for number, path in item.looks_at:
                    own[number] += places[path]
                places[element.path] = place
                self.ints += [0, len(self.numbers), place, first, *own]
                self.numbers += item.numbers
        self.ints[MODEL.ITEMS], self.ints[MODEL.ITEM_AT] = len(records), len(self.ints)
        self.ints += records
        self.ints[MODEL.CONTACT_AT] = len(self.ints)
        self.ints += pairs
        self.ints[MODEL.EQUILIBRIA], self.ints[MODEL.EQUILIBRIUM_AT] = len(settling), len(self.ints)
        for place, kernel in settling.items():
            self.equilibria[len(self.ints)] = kernel
            self.ints += [0, place]
        self.ints[MODEL.RESPONSES], self.ints[MODEL.RESPONSE_AT] = len(responding), len(self.ints)
        for place, response in responding.items():
            self.responses[len(self.ints)] = response.kernel
            self.ints += [0, place, ITEM.OWN + response.first_state, response.states, response.sense]
        room = self.room(LANES * ROWS) if any(kernel for kernel, _ in runs) else 0
        self.ints[MODEL.RUNS], self.ints[MODEL.RUN_AT] = len(runs), len(self.ints)
        for (kernel, first), end in zip(runs, [*(run[1] for run in runs[1:]), len(records)], strict=False):
            if end - first >= FEWEST and kernel:
                self.runs[len(self.ints)] = kernel
            self.ints += [0, first, end, room]
        return result

    def control_record(self) -> None:
        """Write the controls, if there are any, behind all else: some motions have others there."""
        if not self.controls.names:
            return
        self.ints[MODEL.CONTROLS] = len(self.ints)
        own, numbers, self.kernels[len(self.ints)] = self.controls.record()
        self.ints += [0, len(self.numbers), self.ints[MODEL.WORK_CONTROL], 0, *own]
        self.numbers += numbers


def _kind_of(matrix: Array) -> int:
    if not np.array_equal(matrix[:3, :3], np.eye(3)):
        return TRANSFORM.MOVE
    return TRANSFORM.SHIFT if matrix[:3, 3].any() else TRANSFORM.NOTHING
