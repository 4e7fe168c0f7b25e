"""Muscle forces of a recorded motion in one call: static optimization, and its results as tables and files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from osimlite.base.files import make_folder, open_atomically
from osimlite.base.records import dataclass, field
from osimlite.io.tables.storage import StoTable, write_sto
from osimlite.io.tables.writers import format_control_set
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.smoothing_spline import derivatives_of_samples
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.forces import Force
from osimlite.schema.model import Model
from osimlite.simulation.inverse_dynamics import add_forces, followed, loads_of
from osimlite.simulation.recorded_motion import Recorded, RecordedMotion
from osimlite.simulation.static_optimization import TITLE, Shared, StaticOptimization

if TYPE_CHECKING:
    from osimlite.schema.prescribed import ExternalLoads

_HALF_ORDER = 3
"""OpenSim differentiates speeds by splines of fifth degree."""


@dataclass(frozen=True, eq=False)
class MuscleForces(StoTable):
    """Activations of all actuators: a column for each, which is its control too; NaN at times without a solution.

    Attributes: forces: what the forces of the model and the loads push with (N, N m), labelled as
        by OpenSim's ForceReporter. shared: which times have a solution, and what is missing at the
        others. motion: that takes these forces.
    """

    forces: StoTable | None = field(default=None, repr=False)
    shared: Shared | None = field(default=None, repr=False)
    motion: RecordedMotion | None = field(default=None, repr=False)

    @property
    def solved(self) -> NDArray[np.bool_]:
        """Which of the times (t,) have a solution."""
        assert self.shared is not None
        return self.shared.solved

    def unsolved(self) -> str:
        """The times without a solution in words, with the coordinates that lack strength; empty if there are none."""
        assert self.shared is not None
        return self.shared.unsolved()

    def write(self, folder: str | Path) -> list[Path]:
        """Write activations, forces and controls into a folder, under the names of OpenSim's analysis.

        Returns:
            The files.

        Raises:
            OsimliteError: one cannot be written.
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
    motion: Recorded,
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
    """How muscles and other actuators share what a motion takes: the activations with the least sum of |x|ᵖ.

    Each time is solved for itself, exactly: there is one solution or none. The speeds are the rates
    of the coordinates by splines of fifth degree, and their rates those of such splines through the
    speeds, as in OpenSim.

    Args: model: whose actuators push within their min_control and max_control. motion: as of
        :func:`kinematics`. external_loads: as of :func:`inverse_dynamics`. times: of arrays (t,),
        s. applied_to: as of :func:`inverse_dynamics`. forces: what pushes besides, such as reserve
        actuators: files of ForceSets, or forces. replace_forces: whether these take the place of
        the model's own. exponent: p, more than 1. muscles: "active", as in OpenSim: its fibers,
        along a tendon taken for rigid, without passive forces; "isometric": its
        max_isometric_force. lowpass: Hz of OpenSim's filter of the coordinates, if there is to be
        one. start: first time, s. end: last time, s. wrapping: how paths bend around surfaces, see
        :class:`osimlite.simulation.Options`. opensim_derivatives: whether the mistakes of OpenSim's
        CustomJoints are repeated. folder: where the model's file is, for the files that it names;
        the folder that the program runs in if None.

    Returns: A column for each actuator; a time without a solution has no numbers, and `unsolved`
        says what is missing.

    Raises: OsimliteError: it is no motion of the model, or forces or loads cannot be read.
        SettingError: no time lies between the first and the last, there are too few, or a choice is
        none. ModelError: there are no actuators, or fewer than coordinates that they are to
        accelerate. UnsupportedError: a force cannot be computed, or is not proportional to its
        control.
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
        external_loads=loads_of(external_loads, applied_to),
        folder=folder,
    )
    recorded = followed(mechanism, motion, times, False, lowpass, start, end)
    values, speeds, accelerations = _moving(model, mechanism, recorded)
    shared = problem.share(recorded.times, values, speeds, accelerations)
    all_forces = problem.records(shared, values, speeds)
    return MuscleForces(
        TITLE,
        shared.times,
        shared.names,
        shared.activations,
        forces=all_forces,
        shared=shared,
        motion=recorded,
    )


def _moving(
    model: Model, mechanism: Mechanism, recorded: RecordedMotion
) -> tuple[Array, Array, Array]:
    """Values, speeds and accelerations (t, n) of a motion, of which the constraints hold."""
    times, values = recorded.around or (recorded.times, recorded.values)
    around = RecordedMotion(mechanism, times, values)
    all_speeds = around.rates[0].copy()
    if mechanism.turning:
        for q, u in zip(values, all_speeds, strict=True):
            u[:] = mechanism.speeds_from_rates(q, u)
    (accelerations,) = derivatives_of_samples(times, all_speeds, recorded.times, (1,), _HALF_ORDER)
    speeds = all_speeds[np.searchsorted(times, recorded.times)]
    if not mechanism.constraints:
        return recorded.values, speeds, accelerations
    assembled = recorded.assembled().values
    if model.constraint_set.objects and not recorded.missing:
        # As OpenSim has it: what was recorded of all coordinates has speeds that agree.
        return assembled, speeds, accelerations
    moments = zip(recorded.times.tolist(), assembled, speeds, strict=True)
    return (
        assembled,
        np.array([mechanism.project_speeds(q, u, t) for t, q, u in moments]),
        accelerations,
    )
