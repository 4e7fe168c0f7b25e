"""Static optimization of a recorded motion in one call, with its results as tables and files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from osimlite.base.deprecation import make_deprecated_method
from osimlite.base.files import make_folder, open_atomically
from osimlite.base.progress import watch_items
from osimlite.base.records import dataclass, field
from osimlite.io.tables.storage import StoTable, write_sto
from osimlite.io.tables.writers import format_control_set
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.smoothing_spline import derivatives_of_samples
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.forces import Force
from osimlite.schema.model import Model
from osimlite.simulation.inverse_dynamics import add_forces, prepare_motion, resolve_loads
from osimlite.simulation.recorded_motion import MotionSource, RecordedMotion
from osimlite.simulation.shared_forces import TITLE, SharedForces
from osimlite.simulation.static_optimization import StaticOptimization

if TYPE_CHECKING:
    from osimlite.schema.prescribed import ExternalLoads

_HALF_SPLINE_ORDER = 3
"""Half of the order of OpenSim's splines of fifth degree, with which speeds are differentiated."""


@dataclass(frozen=True, eq=False)
class MuscleForces(StoTable):
    """Activations of all actuators over time.

    As a table it has one column for each actuator, equal to its control; NaN at times without a
    solution.

    Attributes:
        forces: forces of the model and of the loads (N, N m), labelled as by OpenSim's
            ForceReporter.
        shared: distribution of the generalized forces over the actuators, with the times without a
            solution.
        motion: motion that requires the forces.
    """

    forces: StoTable | None = field(default=None, repr=False)
    shared: SharedForces | None = field(default=None, repr=False)
    motion: RecordedMotion | None = field(default=None, repr=False)

    @property
    def solved(self) -> NDArray[np.bool_]:
        """Flags of the times (t,) that have a solution."""
        assert self.shared is not None
        return self.shared.solved

    def describe_unsolved(self) -> str:
        """Describe the times without a solution and the coordinates that lack force.

        Returns:
            A phrase for a message; empty if every time has a solution.
        """
        assert self.shared is not None
        return self.shared.describe_unsolved()

    unsolved = make_deprecated_method("describe_unsolved")

    def write(self, folder: str | Path) -> list[Path]:
        """Write activations, forces and controls, with the file names of OpenSim's analysis.

        Args:
            folder: output folder; it is made if it does not exist.

        Returns:
            Paths of the files.

        Raises:
            OsimliteError: a file cannot be written.
        """
        assert self.forces is not None
        folder = Path(folder)
        make_folder(folder)
        ends = ("activation.sto", "force.sto", "controls.xml")
        paths = [folder / f"StaticOptimization_{end}" for end in ends]
        for path, table in zip(paths, (self, self.forces), strict=False):
            # NaN stands for the times without a solution, which the caller reports.
            has_missing = not self.solved.all()
            write_sto(
                path,
                table.name,
                table.times,
                table.columns,
                table.rows.tolist(),
                has_missing=has_missing,
            )
        with open_atomically(paths[-1]) as stream:
            stream.writelines(line.encode() for line in format_control_set(self))
        return paths


def static_optimization(
    model: Model,
    motion: MotionSource,
    external_loads: str | Path | ExternalLoads | None = None,
    *,
    times: ArrayLike | None = None,
    applied_to: Mapping[str, Sequence[Sequence[str]]] | None = None,
    forces: Iterable[str | Path | Force] = (),
    replace_forces: bool = False,
    exponent: float = 2.0,
    muscles: str = "active",
    lowpass: float | None = None,
    start: float = -np.inf,
    end: float = np.inf,
    wrapping: str = "opensim",
    opensim_derivatives: bool = False,
    folder: str | Path | None = None,
) -> MuscleForces:
    """Distribute the generalized forces of a motion over muscles and other actuators.

    Of all activations x that cause the motion, the result has the least sum of |x|ᵖ. Each time is
    solved by itself, exactly: it has one solution or none. As in OpenSim, the speeds are rates of
    the coordinates by splines of fifth degree, and the accelerations are rates of such splines
    through the speeds.

    Args:
        model: model, whose actuators act within their min_control and max_control.
        motion: the motion, see :func:`kinematics`.
        external_loads: measured loads, see :func:`inverse_dynamics`; None for none.
        times: times (t,) of a motion that consists of arrays, s; not used for other motions.
        applied_to: assignment of the columns of loads, see :func:`inverse_dynamics`.
        forces: additional forces such as reserve actuators: files of ForceSets, or forces.
        replace_forces: whether `forces` replace the forces of the model.
        exponent: p, greater than 1.
        muscles: "active", as in OpenSim: force of the fibers along a rigid tendon, without passive
            force; "isometric": max_isometric_force.
        lowpass: frequency (Hz) of OpenSim's filter of the coordinates; None for no filter.
        start: first time, s.
        end: last time, s.
        wrapping: method of wrapping, see :class:`osimlite.simulation.Options`.
        opensim_derivatives: whether the errors of OpenSim's CustomJoints are reproduced.
        folder: folder of the model's file, in which named files are searched; the current folder if
            None.

    Returns:
        A column for each actuator. Times without a solution are NaN, and `describe_unsolved`
        describes the missing generalized forces.

    Raises:
        OsimliteError: the source is not a motion of the model, or forces or loads cannot be read.
        SettingError: no time lies between the first and the last, there are too few, or an option
            has no such value.
        ModelError: there are no actuators, or fewer than coordinates to accelerate.
        UnsupportedError: osimlite cannot compute a force, or it is not proportional to its control.
    """
    model = model.copy_deep()
    add_forces(model, forces, replace=replace_forces)
    mechanism = build_mechanism(model, opensim_derivatives=opensim_derivatives)
    problem = StaticOptimization(
        model,
        mechanism,
        exponent=exponent,
        muscles=muscles,
        wrapping=wrapping,
        external_loads=resolve_loads(external_loads, applied_to),
        folder=folder,
    )
    recorded = prepare_motion(mechanism, motion, times, False, lowpass, start, end)
    values, speeds, accelerations = _compute_states(model, mechanism, recorded)
    shared = problem.solve_motion(recorded.times, values, speeds, accelerations)
    all_forces = problem.report_forces(shared, values, speeds)
    return MuscleForces(
        TITLE,
        shared.times,
        shared.names,
        shared.activations,
        forces=all_forces,
        shared=shared,
        motion=recorded,
    )


def _compute_states(
    model: Model, mechanism: Mechanism, recorded: RecordedMotion
) -> tuple[Array, Array, Array]:
    """Compute the states of a motion that fulfil the constraints.

    Args:
        model: model whose actuators cause the motion.
        mechanism: mechanism of the model.
        recorded: motion of the mechanism.

    Returns:
        Values (rad, m), generalized speeds and accelerations of all coordinates, (t, n) each.
    """
    # A part of a record is differentiated with the rows around it, so that its ends are not
    # special.
    times, values = recorded.around or (recorded.times, recorded.values)
    around = RecordedMotion(mechanism, times, values)
    all_speeds = around.rates[0].copy()
    # Speeds of ball joints and the like are not the rates of their coordinates.
    if mechanism.turning:
        for q, u in zip(values, all_speeds, strict=True):
            u[:] = mechanism.speeds_from_rates(q, u)
    (accelerations,) = derivatives_of_samples(
        times, all_speeds, recorded.times, (1,), _HALF_SPLINE_ORDER
    )
    speeds = all_speeds[np.searchsorted(times, recorded.times)]
    if not mechanism.constraints:
        return recorded.values, speeds, accelerations
    assembled = recorded.assemble_poses().values
    if model.constraint_set.objects and not recorded.missing:
        # OpenSim uses the recorded speeds if all coordinates were recorded.
        return assembled, speeds, accelerations
    moments = [*zip(recorded.times.tolist(), assembled, speeds, strict=True)]
    return (
        assembled,
        np.array(
            [
                mechanism.project_speeds(q, u, t)
                for t, q, u in watch_items("fulfilling the constraints", moments)
            ]
        ),
        accelerations,
    )
