"""Assembly of all poses of a motion in one call of the kernels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from osimlite.base.progress import divide_rows
from osimlite.mechanics.kernels import assembly
from osimlite.mechanics.kernels.assembly_equations import HOLD
from osimlite.mechanics.kernels.layout import CONSTRAINED, MODEL
from osimlite.mechanics.kernels.table import LAW_NUMBERS
from osimlite.mechanics.multibody.assembly import tolerance_of
from osimlite.mechanics.multibody.constraints import Coupler, Lock
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.engines.linking import READY_CODE, Code, select_code

ASSEMBLY_KERNEL = "assemble_poses"
"""Name of the kernel that assembles poses."""
MAX_PYTHON_POSES = 20
"""Number of poses up to which Python is faster than compiling the kernel."""


def assemble_motion(
    mechanism: Mechanism, times: Array, values: Array, code: Code | None = None
) -> Array:
    """Move every pose of a motion to the nearest one that fulfils the constraints.

    The result equals that of `Mechanism.assemble` for each pose.

    Args:
        mechanism: the mechanism.
        times: times of the poses (t,), s.
        values: values of all coordinates (t, n), rad and m.
        code: backend that runs the kernels; None for machine code, or for Python if the poses are
            few and no machine code is compiled yet.

    Returns:
        The assembled values (t, n).

    Raises:
        SimulationError: no pose near one of these fulfils the constraints.
    """
    # Locked coordinates keep the recorded values, so that nothing is left to assemble.
    if all(isinstance(item, Lock) for item in mechanism.constraints):
        return values.copy()
    if code is None:
        code = select_code() if len(times) > MAX_PYTHON_POSES else READY_CODE
    program = mechanism.program
    order = program.order
    size = len(order)
    functions = (ASSEMBLY_KERNEL, *program.laws)
    # Python replaces machine code where these kernels cannot be compiled.
    code = code.select_for(functions)
    code.make_ready(functions)
    ints = np.array(program.model, dtype=np.int64)
    for name in program.laws:
        ints[MODEL.LAWS + LAW_NUMBERS[name]] = code.get_address(name)
    equations = int(ints[ints[MODEL.CONSTRAINED] + CONSTRAINED.POSITIONS])
    frames = np.ascontiguousarray(np.column_stack([times, values[:, order]]))
    assembled = np.empty((len(times), size + 1))
    parts = (
        ints,
        np.array(program.reals, dtype=np.float64),
        np.zeros(int(ints[MODEL.WORK_SIZE])),
        np.zeros(2 * size),
        np.zeros(2 * size),
        np.array(_pack_integers(mechanism, order), dtype=np.int64),
        np.array(_list_numbers(mechanism, order)),
        np.zeros(assembly.assembly_work_size(equations, size)),
    )
    entry = code.get_entry(ASSEMBLY_KERNEL)
    for rows in divide_rows("fulfilling the constraints", len(times)):
        entry(*parts, frames[rows], assembled[rows], rows.stop - rows.start)
    result: Array = np.empty_like(values)
    result[:, order] = assembled[:, :size]
    for row in np.flatnonzero(assembled[:, size] != assembly.POSE_STATUS.ASSEMBLED).tolist():
        # The search in Python raises an error with an explanation.
        result[row] = mechanism.assemble(values[row], float(times[row]))
    return result


def _pack_integers(mechanism: Mechanism, order: Sequence[int]) -> list[int]:
    """Pack the structure of a mechanism for the kernel :mod:`osimlite.mechanics.kernels.assembly`.

    Args:
        mechanism: the mechanism.
        order: indices of the coordinates in the order of the kernels.

    Returns:
        Whether links must be evaluated, the number of couplers, four flags for each coordinate, and
        the dependent coordinate and equation of each coupler.
    """
    program = mechanism.program
    infos = [mechanism.coordinates[index] for index in order]
    turning = any(not program.bound.isdisjoint(item.coordinates) for item in mechanism.turning)
    couplers = [item for item in mechanism.constraints if isinstance(item, Coupler)]
    # Without constraints on bodies the positions of the links need not be computed, which is much
    # faster.
    result = [int(program.on_bodies or turning), len(couplers)]
    result += [HOLD.HELD_BY_USER if info.locked else HOLD.FREED for info in infos]
    result += [int(not info.yielding) for info in infos]
    result += [int(info.clamped) for info in infos]
    result += [0] * len(infos)
    for item in couplers:
        result += [order.index(item.dependent), program.equations_of(item)[0]]
    return result


def _list_numbers(mechanism: Mechanism, order: Sequence[int]) -> list[float]:
    """Return the numbers of the assembly, see :mod:`osimlite.mechanics.kernels.assembly`.

    Args:
        mechanism: the mechanism.
        order: indices of the coordinates in the order of the kernels.

    Returns:
        The tolerance of the constraints, and the lower and upper end of the range of each
        coordinate.
    """
    result = [tolerance_of(mechanism)]
    for index in order:
        result += mechanism.coordinates[index].range
    return result
