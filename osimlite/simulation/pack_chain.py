"""Packing of a robot chain whose mass matrix another program computes.

PyBullet computes with joints of one axis. The kernels map the m degrees of freedom of the mechanism
to the joints: the rates of the joints are v = P u, hence M = Pᵀ M_joints P. A *derivative* is a nonzero
entry of P.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from osimlite.base.named_tuples import NamedTuple
from osimlite.mechanics.kernels.layout import (
    CHAIN,
    DOF,
    EXCESS,
    JOINT,
    JOINT_DERIVATIVE,
    JOINT_SOURCE,
    MODEL,
    MOTION,
    PRODUCT,
)
from osimlite.mechanics.multibody.motions import AccelerationErrorAngle, EllipsoidPoint
from osimlite.mechanics.multibody.parts import GROUND
from osimlite.simulation.robot.couplings import find_line
from osimlite.simulation.robot.robot import RobotJoint

if TYPE_CHECKING:
    from osimlite.simulation.pack import Packer


class Chain(NamedTuple):
    """Robot whose mass matrix and bias another program computes."""

    joints: Sequence[RobotJoint]  # moving joints, in the order of the other program
    # bodies, and the number added to their principal moments of inertia there (kg·m²)
    excess: Sequence[tuple[int, float]]
    # kernel in Python. It reads values, rates and accelerations of the joints from the work vector,
    # and writes after them the joint forces that these accelerations require against gravity, and
    # the mass matrix.
    supply: Callable[..., None]


def pack_chain(packer: Packer, chain: Chain) -> None:
    """Write the records of a chain, if it has any joints.

    Args:
        packer: writer of the kernel vectors, in which the mechanism is written already.
        chain: the chain.
    """
    ints = packer.ints
    count = len(chain.joints)
    if not count:
        return
    start = ints[MODEL.CHAIN] = len(ints)
    ints += [0] * CHAIN.SIZE
    packer.kernels[start + CHAIN.SUPPLY] = chain.supply
    records: list[int] = []
    derivatives: list[tuple[int, int]] = []
    for number, joint in enumerate(chain.joints):
        joint_kind, source, part, freedoms = _encode_joint(packer, joint)
        records += JOINT.record(
            KIND=joint_kind, SOURCE=source, PART=part, FIRST_DERIVATIVE=len(derivatives)
        )
        derivatives += [(number, freedom) for freedom in freedoms]
    derivative_records = [
        item
        for joint, freedom in derivatives
        for item in JOINT_DERIVATIVE.record(JOINT=joint, DOF=freedom)
    ]
    lists = {
        ("JOINTS", "JOINT_AT"): (JOINT.SIZE, records),
        ("DERIVATIVES", "DERIVATIVE_AT"): (JOINT_DERIVATIVE.SIZE, derivative_records),
        ("PRODUCTS", "PRODUCT_AT"): (PRODUCT.SIZE, _list_products(packer, derivatives, count)),
        ("EXCESSES", "EXCESS_AT"): (EXCESS.SIZE, list_excesses(packer, chain.excess)),
    }
    # The four lists follow the head. Each pair of names is a field for its length and one for its
    # offset.
    list_fields: dict[str, int] = {}
    for (count_field, offset_field), (record_size, numbers) in lists.items():
        list_fields |= {count_field: len(numbers) // record_size, offset_field: len(ints)}
        ints += numbers
    entries = ints[ints[MODEL.DOF_AT] + DOF.ROW]
    ints[start : start + CHAIN.SIZE] = CHAIN.record(
        DYNAMICS=packer.require_law("chain_dynamics"),
        SUPPLY=0,
        WORK_JOINTS=packer.reserve_work((4 + count) * count),
        WORK_DERIVATIVES=packer.reserve_work(len(derivatives)),
        ENTRY_AT=entries,
        END_ENTRY=entries + packer.entries,
        **list_fields,
    )


def _encode_joint(packer: Packer, joint: RobotJoint) -> tuple[int, int, int, list[int]]:
    """Return the description of a joint for the kernels.

    Args:
        packer: writer of the kernel vectors.
        joint: a moving joint.

    Returns:
        Kind of the joint (`JOINT_SOURCE`), source (index of an operation or of a degree of freedom),
        part (a component, or the index of a number), and the degrees of freedom that move it.
    """
    function = joint.function
    coordinates = list(joint.coordinates)
    freedoms = [packer.link_map.freedom(coordinate) for coordinate in coordinates]
    for number, operation in enumerate(packer.operations):
        if operation.joint != joint.source:
            continue
        # The order of the cases matters: a ball joint or an ellipsoid joint has three joints of one
        # axis, all with the same source.
        is_ball = operation.kind in (MOTION.BALL, MOTION.BALL_BACK)
        if operation.kind == MOTION.ACCELERATION_ERROR and isinstance(
            function, AccelerationErrorAngle
        ):
            return JOINT_SOURCE.ERROR, number, function.component, []
        if is_ball and isinstance(function, EllipsoidPoint):
            return JOINT_SOURCE.ELLIPSOID, number, function.component, freedoms
        if is_ball and len(coordinates) == 1 and coordinates[0] in operation.arguments:
            angles = [packer.link_map.freedom(coordinate) for coordinate in operation.arguments]
            return JOINT_SOURCE.ANGLE, number, operation.arguments.index(coordinates[0]), angles
        if operation.function is function and operation.arguments == coordinates:
            return JOINT_SOURCE.AMOUNT_OF, number, 0, freedoms
    # What remains are joints that are the coordinate itself or a multiple of it, as the couplings
    # of `build_robot` make them.
    line = find_line(function)
    assert line is not None and line.offset == 0.0, f"nothing moves '{joint.name}'"
    packer.numbers.append(line.slope)
    return JOINT_SOURCE.LINE, freedoms[0], len(packer.numbers) - 1, freedoms


def _list_products(packer: Packer, derivatives: Sequence[tuple[int, int]], count: int) -> list[int]:
    """Return the records of the products that make the mass matrix of the mechanism.

    Entry (i, j) of Pᵀ M_joints P is a sum over pairs of derivatives. Only the entries of a degree of
    freedom and those above it in the tree are nonzero, so each row is followed up to the root.

    Args:
        packer: writer of the kernel vectors.
        derivatives: index of the joint and of the degree of freedom for each derivative.
        count: number of joints, the size of the other program's matrix.

    Returns:
        Records with both derivatives, the entry of the other program's matrix, and the offset of the
        sum.
    """
    derivatives_of_freedom: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for number, (joint, freedom) in enumerate(derivatives):
        derivatives_of_freedom[freedom].append((number, joint))
    result: list[int] = []
    freedoms = packer.ints[packer.ints[MODEL.DOF_AT] :]
    for freedom in range(packer.ints[MODEL.DOFS]):
        entry = freedoms[DOF.SIZE * freedom + DOF.ROW]
        ancestor = freedom
        # Up to the root, whose freedoms have none above: -1.
        while ancestor >= 0:
            for row_derivative, i in derivatives_of_freedom[freedom]:
                for column_derivative, j in derivatives_of_freedom[ancestor]:
                    result += PRODUCT.record(
                        ONE=row_derivative, TWO=column_derivative, ENTRY=count * i + j, TARGET=entry
                    )
            entry = entry + 1
            ancestor = freedoms[DOF.SIZE * ancestor + DOF.ABOVE]
    return result


def list_excesses(packer: Packer, excess: Sequence[tuple[int, float]]) -> list[int]:
    """Return the records of added inertia.

    Another program may round small moments of inertia up. The kernels then subtract the excess
    again.

    Args:
        packer: writer of the kernel vectors.
        excess: bodies, and the number that is added to each of their principal moments of inertia in
            the other program (kg·m²).

    Returns:
        Records with the link, the last degree of freedom on the path to it, and the offset of the
        added moment in the numbers. Bodies that cannot move have none.
    """
    result: list[int] = []
    for body, moment in excess:
        link = carrier = packer.link_map.placements[body].link
        # Links without a degree of freedom of their own move with their parents.
        while carrier != GROUND and packer.ends[carrier] == packer.ends[carrier + 1]:
            carrier = packer.links[carrier].parent
        if carrier != GROUND:
            result += EXCESS.record(
                LINK=link, DOF=packer.ends[carrier + 1] - 1, NUMBER=len(packer.numbers)
            )
            packer.numbers.append(moment)
    return result
