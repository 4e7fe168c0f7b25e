"""Links of a mechanism, and their packing into the vectors of the kernels."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, field
from osimlite.errors import UnsupportedError
from osimlite.mechanics.kernels.functions import FUNCTION_TYPE
from osimlite.mechanics.kernels.layout import (
    CONSTRAINED,
    CONSTRAINT,
    DOF,
    LINK,
    LINK_WORK,
    MODEL,
    MOTION,
    OPERATION,
    OPERATION_WORK,
    TRANSFORM,
    WORK,
)
from osimlite.mechanics.kernels.table import LAW_NUMBERS
from osimlite.mechanics.multibody.constraint_records import constraint_record, count_constraint_work
from osimlite.mechanics.multibody.constraints import ConstraintEquations
from osimlite.mechanics.multibody.function_tables import function_table
from osimlite.mechanics.multibody.functions import IDENTITY
from osimlite.mechanics.multibody.joints import Mobilizer
from osimlite.mechanics.multibody.motions import (
    AxisMotion,
    FixedTransform,
    JointMotion,
    SimbodyAccelerationError,
    SphericalMotion,
)
from osimlite.mechanics.multibody.parts import GROUND
from osimlite.mechanics.multibody.spatial import (
    Array,
    invert_transform,
    make_transform,
    rotation_about,
    skew_matrix,
)

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.mechanism import Mechanism

LAWS_OF_FUNCTIONS = {
    FUNCTION_TYPE.MONOMIALS: "amount_by_several",
    FUNCTION_TYPE.MONOMIALS_OF_OPENSIM: "amount_by_several",
    FUNCTION_TYPE.ARC: "amount_by_arc",
}
"""Law of each kind of function that takes several coordinates."""


class Placement(NamedTuple):
    """Link that a body belongs to, and the body's frame in it."""

    link: int  # index of the link, -1 for ground
    frame: Array  # frame of the body in the link (4, 4)


@dataclass(frozen=True)
class LinkMap:
    """Degrees of freedom of coordinates, and links of bodies."""

    mechanism: Mechanism  # mechanism of the model
    freedoms: Mapping[int, int]  # degree of freedom of each free coordinate, by its index
    placements: list[Placement]  # link and frame of each body

    def freedom(self, coordinate: int) -> int:
        """Return the degree of freedom of a coordinate, -1 if it is locked."""
        return self.freedoms.get(coordinate, -1)

    def get_locked_value(self, coordinate: int) -> float:
        """Return the value that a coordinate has if it is locked (rad or m)."""
        return float(self.mechanism.coordinates[coordinate].default_value)

    def placement(self, body: int) -> Placement:
        """Return the link and frame of a body, or of ground."""
        return self.placements[body] if body != GROUND else Placement(GROUND, np.eye(4))

    def station(self, body: int, point: Sequence[float]) -> tuple[int, tuple[float, ...]]:
        """Return a point of a body in the link of the body.

        Args:
            body: index of the body, -1 for ground.
            point: point in the frame of the body (3,), m.

        Returns:
            Index of the link, and the point in the link (3,), m.
        """
        link, frame = self.placement(body)
        return link, tuple((frame[:3, :3] @ np.array(point) + frame[:3, 3]).tolist())

    def direction(self, body: int, vector: Sequence[float]) -> tuple[float, ...]:
        """Return a direction of a body in the link of the body.

        Args:
            body: index of the body, -1 for ground.
            vector: direction in the frame of the body (3,).

        Returns:
            Direction in the link (3,).
        """
        return tuple((self.placement(body).frame[:3, :3] @ np.array(vector)).tolist())

    def frame(self, body: int, frame: Array) -> tuple[int, list[float]]:
        """Return a frame of a body in the link of the body.

        Args:
            body: index of the body, -1 for ground.
            frame: frame in the body (4, 4).

        Returns:
            Index of the link; the three axes and the origin in the link, one after the other (12,).
        """
        link, of_body = self.placement(body)
        return link, (of_body @ frame)[:3].T.ravel().tolist()


@dataclass
class Operation:
    """Fixed transform, and one motion after it; see `layout.OPERATION`."""

    kind: int  # type of the motion, see `layout.MOTION`
    before: Array  # fixed transform before the motion (4, 4)
    arguments: list[int]  # indices in the mechanism of the coordinates of the motion
    function: Any = None  # function that gives the amount, None if a coordinate does
    radii: Array = field(default_factory=lambda: np.zeros(3))  # half axes of an ellipsoid, m
    axis: Array = field(default_factory=lambda: np.array((0.0, 0.0, 1.0)))  # axis of a slide
    rotations: list[Operation | None] = field(default_factory=list)  # rotations of a drift's joint
    drift_inputs: list[int] = field(default_factory=list)  # sign and two coordinates of a drift
    joint: str = ""  # path of the joint


@dataclass
class Link:
    """Body, or several that never move relative to each other, with its joint."""

    parent: int  # index of the link that carries it, -1 for ground
    operations: list[Operation]  # motions of the joint, in order
    mass: float = 0.0  # kg
    mass_moment: Array = field(default_factory=lambda: np.zeros(3))  # mass times centre, kg m
    origin_inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))  # about origin, kg m²


class LinkTree(NamedTuple):
    """Links of a mechanism."""

    links: list[Link]  # links, parents first
    ends: list[int]  # 0, then the end of the degrees of freedom of each link
    order: tuple[int, ...]  # index in the mechanism of the coordinate of each degree of freedom
    link_map: LinkMap  # degrees of freedom and links by coordinates and bodies


def tree_of(
    mechanism: Mechanism, free: Collection[int], *, keep_fixed_bodies: bool = False
) -> LinkTree:
    """Return the links of a mechanism.

    Args:
        mechanism: mechanism.
        free: indices of the coordinates that are degrees of freedom; the others keep their
            defaults.
        keep_fixed_bodies: whether bodies that never move relative to each other are separate links.

    Raises:
        UnsupportedError: the kernels do not know the motion of a joint.
    """
    links: list[Link] = []
    placements: list[Placement] = []
    free = set(free)
    for body in mechanism.bodies:
        parent, frame = (GROUND, np.eye(4)) if body.parent == GROUND else placements[body.parent]
        operations, remaining_frame = _list_operations(mechanism, body.mobilizer, frame, free)
        # A body without motions of its own is merged into the link that carries it.
        if operations or keep_fixed_bodies:
            links.append(Link(parent, operations))
            parent = len(links) - 1
        placements.append(Placement(parent, remaining_frame))
        if parent != GROUND:
            _add_body_mass(links[parent], body.mass_properties, remaining_frame)
    order: list[int] = []
    ends = [0]
    for link in links:
        indices = {index for item in link.operations for index in item.arguments}
        # Within a link, degrees of freedom are in the order of the coordinates.
        order += sorted(indices & free)
        ends.append(len(order))
    freedoms = {index: number for number, index in enumerate(order)}
    return LinkTree(links, ends, tuple(order), LinkMap(mechanism, freedoms, placements))


def _list_operations(
    mechanism: Mechanism, mobilizer: Mobilizer, frame: Array, free: set[int]
) -> tuple[list[Operation], Array]:
    """Return the operations of a joint, and the frame of the carried body after the last one.

    Args:
        mechanism: mechanism.
        mobilizer: joint.
        frame: frame of the carrying body in its link (4, 4).
        free: indices of the coordinates that are degrees of freedom.

    Returns:
        Operations, and the frame of the carried body in the new link (4, 4).

    Raises:
        UnsupportedError: the kernels cannot compute a motion of the joint.
    """
    joint_coordinates = mobilizer.coordinates
    chain: list[JointMotion] = [
        FixedTransform(mobilizer.parent_frame),
        *mobilizer.motions,
        FixedTransform(invert_transform(mobilizer.child_frame)),
    ]
    # A reversed joint passes its motions backwards, each inverted.
    if mobilizer.reversed:
        chain.reverse()
    result: list[Operation] = []
    of_motion: dict[int, Operation] = {}
    drifts: list[tuple[Operation, SimbodyAccelerationError]] = []
    for motion in chain:
        indices = [joint_coordinates[number] for number in motion.coordinates]
        is_fixed = free.isdisjoint(indices)
        if isinstance(motion, FixedTransform):
            frame = frame @ (
                invert_transform(motion.matrix) if mobilizer.reversed else motion.matrix
            )
        # An error of accelerations matters only where coordinates move.
        elif isinstance(motion, SimbodyAccelerationError):
            if motion.elementary() and not free.isdisjoint(joint_coordinates):
                sign = -1 if mobilizer.reversed else 1
                result.append(
                    Operation(
                        MOTION.ACCELERATION_ERROR,
                        frame,
                        [],
                        drift_inputs=[sign, *joint_coordinates[:2]],
                    )
                )
                drifts.append((result[-1], motion))
                frame = np.eye(4)
        # A motion whose coordinates are all locked is a fixed transform.
        elif is_fixed:
            q = np.zeros(len(joint_coordinates))
            q[list(motion.coordinates)] = [
                mechanism.coordinates[index].default_value for index in indices
            ]
            matrix = motion.transform(q)
            frame = frame @ (invert_transform(matrix) if mobilizer.reversed else matrix)
        elif isinstance(motion, AxisMotion):
            axis = -motion.axis if mobilizer.reversed else motion.axis
            function = None if motion.function == IDENTITY else motion.function
            # Kernels rotate about z only; the fixed transforms before and behind bring the axis
            # there.
            if motion.kind == "rotate":
                rotation = make_transform(_to_axis(axis))
                result.append(Operation(MOTION.TURN, frame @ rotation, indices, function))
                of_motion[id(motion)] = result[-1]
                frame = invert_transform(rotation)
            else:
                result.append(Operation(MOTION.SLIDE, frame, indices, function, axis=axis))
                frame = np.eye(4)
        elif isinstance(motion, SphericalMotion):
            operation_kind = MOTION.BALL_BACK if mobilizer.reversed else MOTION.BALL
            result.append(Operation(operation_kind, frame, indices, radii=motion.radii))
            frame = np.eye(4)
        else:
            raise UnsupportedError(
                f"the {type(motion).__name__} of '{mobilizer.joint}' cannot be computed"
            )
    for operation in result:
        operation.joint = mobilizer.joint
    for operation, drift in drifts:
        operation.rotations = [of_motion.get(id(turn)) for turn in drift.rotations]
    return result, frame


def _to_axis(axis: Array) -> Array:
    """Return a rotation (3, 3) that takes z to a unit vector.

    It has no rounding errors if the vector is along a coordinate axis.
    """
    x, y, z = axis.tolist()
    if z == 1.0:
        return np.eye(3)
    if abs(x) == 1.0 or abs(y) == 1.0 or z == -1.0:
        perpendicular = np.array((abs(y), abs(z), abs(x)))
        return np.column_stack((perpendicular, np.cross(axis, perpendicular), axis))
    angle = float(np.arctan2(np.hypot(x, y), z))
    return rotation_about(np.array((-y, x, 0.0)) / np.hypot(x, y), angle)


def _add_body_mass(link: Link, properties: Any, frame: Array) -> None:
    """Add mass, first moment of mass and inertia of a body to those of its link.

    Args:
        link: link; changed. Its moments are about its origin, so that those of bodies add up.
        properties: mass properties of the body.
        frame: frame of the body in the link (4, 4).
    """
    rotation = frame[:3, :3]
    center = rotation @ properties.center + frame[:3, 3]
    link.mass += properties.mass
    link.mass_moment = link.mass_moment + properties.mass * center
    # Parallel axis theorem: R I R' - m [c] [c], from the mass centre to the origin of the link.
    link.origin_inertia = (
        link.origin_inertia
        + rotation @ properties.inertia @ rotation.T
        - properties.mass * _square_of_skew(center)
    )


def _square_of_skew(v: Array) -> Array:
    """Return [v] [v], where [v] is the cross-product matrix: minus the inertia of a unit mass at v."""
    return skew_matrix(v) @ skew_matrix(v)


def _list_inertia(link: Link) -> list[float]:
    """Return mass (kg), mass centre (m) and inertia (kg m²) of a link, in the order of `INERTIA`.

    The inertia of the link is about its origin. That of the record is about the mass centre, by the
    parallel axis theorem, as xx, yy, zz, xy, xz, yz.
    """
    # The mass centre of a link without mass does not matter.
    center = link.mass_moment / link.mass if link.mass != 0.0 else link.mass_moment
    i = link.origin_inertia + link.mass * _square_of_skew(center)
    return [link.mass, *center.tolist(), i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]


class LinkPacker:
    """Packer of a mechanism into the vectors of the kernels."""

    def __init__(self, tree: LinkTree) -> None:
        self.links, self.ends, self.order, self.link_map = tree
        self.operations = [operation for link in self.links for operation in link.operations]
        # The head of the model, and the addresses of all laws, which are filled in later.
        self.ints: list[int] = [0] * (MODEL.LAWS + len(LAW_NUMBERS))
        self.numbers: list[float] = [float(x) for x in self.link_map.mechanism.gravity]
        self.work = WORK.SIZE
        self.entries = 0
        self.balls: dict[tuple[int, ...], int] = {}
        self.laws: list[str] = ["evaluate"]

    def mechanism_records(
        self, constraints: Sequence[ConstraintEquations], lock_count: int = 0
    ) -> None:
        """Write the records of the mechanism.

        Args:
            constraints: constraints to include.
            lock_count: number of coordinates that are locked besides.
        """
        ints = self.ints
        size = len(self.order)
        for link in self.links:
            self.numbers += _list_inertia(link)
        ints[MODEL.FIXED_AT] = len(self.numbers)
        for operation in self.operations:
            frame = operation.before
            self.numbers += [
                *frame[:3, :3].ravel().tolist(),
                *frame[:3, 3].tolist(),
                *operation.axis.tolist(),
            ]
        ints[MODEL.LINKS], ints[MODEL.DOFS] = len(self.links), size
        ints[MODEL.WORK_LINK] = self.reserve_work(LINK_WORK.SIZE * len(self.links))
        ints[MODEL.WORK_OPERATION] = self.reserve_work(OPERATION_WORK.SIZE * len(self.operations))
        ints[MODEL.WORK_COLUMN], ints[MODEL.WORK_PIVOT] = (
            self.reserve_work(6 * size),
            self.reserve_work(size),
        )
        ancestors = self.link_records()
        self.freedom_records(ancestors)
        self.operation_records()
        self.constraint_records(constraints, lock_count)

    def reserve_work(self, count: int) -> int:
        """Reserve numbers in the work vector.

        Returns:
            Offset of the first reserved number in the work vector.
        """
        self.work += count
        return self.work - count

    def require_law(self, name: str) -> int:
        """Return the number of a law, and note that the program needs it."""
        self.laws.append(name)
        return LAW_NUMBERS[name]

    def link_records(self) -> list[int]:
        """Write the records of the links.

        Returns:
            Degree of freedom above each one on the path to ground, or -1.
        """
        self.ints[MODEL.LINK_AT] = len(self.ints)
        ancestors = [-1] * self.ends[-1]
        last_freedoms = [-1] * len(self.links)
        operation = 0
        for number, link in enumerate(self.links):
            first = self.ends[number]
            end = self.ends[number + 1]
            end_operation = operation + len(link.operations)
            self.ints += LINK.record(
                PARENT=link.parent,
                FIRST_OPERATION=operation,
                END_OPERATION=end_operation,
                FIRST_DOF=first,
                END_DOF=end,
            )
            operation = end_operation
            ancestor = last_freedoms[link.parent] if link.parent >= 0 else -1
            for freedom in range(first, end):
                ancestors[freedom], ancestor = ancestor, freedom
            last_freedoms[number] = ancestor
        return ancestors

    def freedom_records(self, ancestors: Sequence[int]) -> None:
        """Write the records of the degrees of freedom, and the list of those with summed columns.

        Args:
            ancestors: degree of freedom above each one, or -1.
        """
        self.ints[MODEL.DOF_AT] = len(self.ints)
        depths: list[int] = []
        for freedom in ancestors:
            # A sparse row of the mass matrix has one entry per degree of freedom on the path to
            # ground.
            depths.append(depths[freedom] + 1 if freedom >= 0 else 0)
            self.ints += DOF.record(
                ABOVE=freedom, ROW=self.reserve_work(depths[-1] + 1), DEPTH=depths[-1]
            )
            self.entries += depths[-1] + 1
        self.ints[MODEL.SUMMED_AT] = len(self.ints)
        summed = [number for number in range(len(ancestors)) if number not in self.simple_freedoms]
        self.ints[MODEL.SUMMED] = len(summed)
        self.ints += summed

    @cached_property
    def simple_freedoms(self) -> set[int]:
        """Degrees of freedom that are the amount of a single one-axis operation only."""
        users: dict[int, list[Operation]] = {}
        for item in self.operations:
            for freedom in {self.link_map.freedom(index) for index in item.arguments}:
                users.setdefault(freedom, []).append(item)
        return {
            freedom
            for freedom, (first, *other_users) in users.items()
            if not other_users
            and first.function is None
            and first.kind in (MOTION.TURN, MOTION.SLIDE)
        }

    def operation_records(self) -> None:
        """Write the records of the operations, and what their functions need."""
        start = self.ints[MODEL.OPERATION_AT] = len(self.ints)
        self.ints += [0] * (OPERATION.SIZE * len(self.operations))
        numbers = {id(item): number for number, item in enumerate(self.operations)}
        for number, item in enumerate(self.operations):
            freedom, law, gradient = -1, OPERATION.SINGLE, 0
            extra = len(self.numbers)
            freedoms = [self.link_map.freedom(index) for index in item.arguments]
            drift_ints: list[int] = []
            if item.kind == MOTION.ACCELERATION_ERROR:
                law = self.require_law("place_drift")
                # The number of the law that moves follows that of the law that places, see
                # `BALL_MOVES`.
                self.require_law("move_drift")
                sign, *watched = item.drift_inputs
                drift_ints = [
                    sign,
                    *(self.link_map.freedom(index) for index in watched),
                    *[-1] * (2 - len(watched)),
                ]
                drift_ints += [-1 if turn is None else numbers[id(turn)] for turn in item.rotations]
            elif item.kind in (MOTION.BALL, MOTION.BALL_BACK):
                law = self.require_law("place_ball")
                self.require_law("move_ball")
                self.numbers += item.radii.tolist()
            elif item.function is None:
                freedom = freedoms[0]
                law = OPERATION.SINGLE if freedom in self.simple_freedoms else OPERATION.SUMMED
            else:
                infos = [self.link_map.mechanism.coordinates[index] for index in item.arguments]
                table = function_table(
                    item.function, f"the function of an axis of the joint '{infos[0].joint}'"
                )
                law = self.require_law(LAWS_OF_FUNCTIONS.get(int(table[0]), "amount_by_one"))
                self.numbers += [*(info.default_value for info in infos), *table]
                gradient = self.reserve_work(len(freedoms))
            arguments = len(self.ints)
            self.ints += [*freedoms, *drift_ints]
            if item.kind in (MOTION.BALL, MOTION.BALL_BACK):
                self.balls[tuple(freedoms)] = arguments
            self.ints[start + OPERATION.SIZE * number : start + OPERATION.SIZE * (number + 1)] = (
                OPERATION.record(
                    MOTION=item.kind,
                    BEFORE=_classify_transform(item.before),
                    DOF=freedom,
                    FUNCTION=law,
                    ARGUMENTS=arguments,
                    ARGUMENT_COUNT=len(freedoms),
                    EXTRA=extra,
                    GRADIENT=gradient,
                )
            )

    def constraint_records(self, enforced: Sequence[ConstraintEquations], locks: int) -> None:
        """Write the records of constraints, if there are any.

        Args:
            enforced: constraints whose records are written.
            locks: number of coordinates that are locked besides.
        """
        if not enforced:
            return
        start = len(self.ints)
        size = self.ints[MODEL.DOFS]
        self.ints[MODEL.CONSTRAINED] = start
        self.ints += [0] * CONSTRAINED.SIZE
        constraints = [constraint_record(item, self.link_map, self.balls) for item in enforced]
        records: list[int] = []
        equations = 0
        for constraint in constraints:
            records.append(len(self.ints))
            end, end_position = equations + constraint.equations, equations + constraint.positions
            # Only here the offset of a constraint's workspace is known.
            ints = [
                x + self.reserve_work(constraint.work_size)
                if k == constraint.work_offset_index
                else x
                for k, x in enumerate(constraint.ints)
            ]
            self.ints += CONSTRAINT.record(
                LAW=self.require_law(constraint.law),
                NUMBERS=len(self.numbers),
                FIRST_EQUATION=equations,
                END_EQUATION=end,
                END_POSITION=end_position,
            )
            self.ints += ints
            self.numbers += constraint.numbers
            equations = end
        record_at = len(self.ints)
        ball_at = len(self.ints) + len(records)
        self.ints += [*records, *self.balls.values()]
        self.ints[start : start + CONSTRAINED.SIZE] = CONSTRAINED.record(
            DYNAMICS=self.require_law("constrained_dynamics"),
            PROJECT=self.require_law("project"),
            FACTORISE=self.require_law("factorise_law"),
            MINIMUM_NORM=self.require_law("minimum_norm_law"),
            CONSTRAINTS=len(constraints),
            CONSTRAINT_AT=record_at,
            BALLS=len(self.balls),
            BALL_AT=ball_at,
            EQUATIONS=equations,
            POSITIONS=sum(constraint.positions for constraint in constraints),
            LOCKS=locks,
            ENTRIES=self.entries,
            **{
                name: self.reserve_work(count)
                for name, count in count_constraint_work(equations, size, self.entries).items()
            },
        )


def _classify_transform(matrix: Array) -> int:
    if not np.array_equal(matrix[:3, :3], np.eye(3)):
        return TRANSFORM.MOVE
    return TRANSFORM.SHIFT if matrix[:3, 3].any() else TRANSFORM.NOTHING
