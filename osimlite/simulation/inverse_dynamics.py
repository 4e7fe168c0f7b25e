"""Kinematics and inverse dynamics of recorded motions, in one call each."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.records import dataclass, field
from osimlite.base.text import format_time_span
from osimlite.errors import SettingError
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.schema.forces import Force, ForceSet
from osimlite.schema.model import Model
from osimlite.simulation.elements import force_elements
from osimlite.simulation.recorded_motion import (
    MotionSource,
    RecordedMotion,
    exclude_forces,
    find_excluded_forces,
)

if TYPE_CHECKING:
    from osimlite.schema.prescribed import ExternalLoads

FORCE_UNITS = {"rad": "N·m", "m": "N"}
"""Units of generalized forces by the units of their coordinates."""


@dataclass(frozen=True, eq=False)
class GeneralizedForces(StoTable):
    """Generalized forces of a motion: a column (N or N·m) for each coordinate.

    Attributes:
        motion: the motion that requires them.
    """

    motion: RecordedMotion | None = field(default=None, repr=False)

    @property
    def units(self) -> Mapping[str, str]:
        """Units of the columns; that of a coupled coordinate is unknown, and without a motion those of forces."""
        coordinates = self.motion.mechanism.coordinates if self.motion is not None else ()
        units = {f"{info.name}_force": FORCE_UNITS.get(info.unit, "") for info in coordinates}
        units |= {name: "N·m" for name in self.columns if name.endswith("_moment")}
        return {name: unit for name in self.columns if (unit := units.get(name))}


def kinematics(
    model: Model,
    motion: MotionSource,
    *,
    times: ArrayLike | None = None,
    assemble: bool = False,
    lowpass: float | None = None,
    start: float = -np.inf,
    end: float = np.inf,
) -> RecordedMotion:
    """Read a motion of a model; its ``bodies()`` and ``markers()`` are tables of positions.

    Args:
        model: model whose coordinates the motion has.
        motion: a .mot or .sto file; a motion, such as a fitted one or a trajectory; or arrays (t,)
            in rad and m by the names or paths of coordinates.
        times: times (t,) of a motion that consists of arrays, s; not used for other motions.
        assemble: whether each pose is first moved to the nearest one that fulfils the constraints.
        lowpass: frequency (Hz) of OpenSim's filter of the coordinates; None for no filter.
        start: first time, s.
        end: last time, s.

    Returns:
        The motion, as a table of coordinates.

    Raises:
        OsimliteError: the source is not a motion of the model.
        SettingError: no time lies between the first and the last, or the filter does not fit the
            times.
        SimulationError: a pose is too far from fulfilling the constraints.
    """
    return prepare_motion(build_mechanism(model), motion, times, assemble, lowpass, start, end)


def inverse_dynamics(
    model: Model,
    motion: MotionSource,
    external_loads: str | Path | ExternalLoads | None = None,
    *,
    times: ArrayLike | None = None,
    applied_to: Mapping[str, Sequence[Sequence[str]]] | None = None,
    exclude: Iterable[str] = ("Muscles",),
    lowpass: float | None = None,
    start: float = -np.inf,
    end: float = np.inf,
    wrapping: str = "opensim",
    opensim_derivatives: bool = False,
    folder: str | Path | None = None,
) -> GeneralizedForces:
    """Return the generalized forces that a motion requires beyond those that act on the model.

    With the mass matrix M, the bias c (Coriolis and centrifugal forces), gravity g and the applied
    forces f, the result is M udot + c - g - f (Featherstone 2008, ch. 5).

    Args:
        model: model on which the forces act.
        motion: the motion, see :func:`kinematics`.
        external_loads: measured loads or their file; with `applied_to` a table (.mot, .sto, .c3d)
            in the axes of ground; None for none.
        times: times (t,) of a motion that consists of arrays, s; not used for other motions.
        applied_to: names of the bodies on which a table of loads acts; for each body and load the
            beginnings of the labels of force, point and moment, such as ``{"calcn_r": [("f1_",
            "p1_", "m1_")]}``. None for loads that name their bodies.
        exclude: forces that are ignored: names of forces or groups, "All", "Actuators" or
            "Muscles".
        lowpass: frequency (Hz) of OpenSim's filter of the coordinates; None for no filter.
        start: first time, s.
        end: last time, s.
        wrapping: method of wrapping, see :class:`osimlite.simulation.Options`.
        opensim_derivatives: whether the errors of OpenSim's CustomJoints are reproduced.
        folder: folder of the model's file, in which named files are searched; the current folder if
            None.

    Returns:
        A column (N or N·m) for each coordinate; those of ball and free joints are moments about
        axes of the parent frame.

    Raises:
        OsimliteError: the source is not a motion of the model, or loads cannot be read.
        SettingError: no time lies between the first and the last, there are too few, or a name does
            not exist.
        UnsupportedError: osimlite cannot compute a force of the model.
    """
    external_loads = resolve_loads(external_loads, applied_to)
    excluded = [*exclude]
    evaluated_model = model
    if find_excluded_forces(model, excluded):
        # The caller's model stays as it is; a copy is needed only if forces are switched off.
        evaluated_model = model.copy_deep()
        exclude_forces(evaluated_model, excluded)
    mechanism = build_mechanism(evaluated_model, opensim_derivatives=opensim_derivatives)
    recorded = prepare_motion(mechanism, motion, times, False, lowpass, start, end)
    # Forces that the caller excludes were switched off in the copy.
    forces = force_elements(
        evaluated_model, mechanism, wrapping=wrapping, external_loads=external_loads, folder=folder
    )
    table = recorded.inverse_dynamics(forces)
    return GeneralizedForces(table.name, table.times, table.columns, table.rows, motion=recorded)


def resolve_loads(
    external_loads: str | Path | ExternalLoads | None,
    applied_to: Mapping[str, Sequence[Sequence[str]]] | None,
) -> str | Path | ExternalLoads | None:
    """Return the external loads, made of a table if `applied_to` assigns its columns.

    Args:
        external_loads: loads, their file, or a table; see :func:`inverse_dynamics`.
        applied_to: assignment of the table's columns, if any.

    Returns:
        Loads that are made of the table, else `external_loads` unchanged.

    Raises:
        SettingError: `applied_to` is set without a table.
    """
    if not applied_to:
        return external_loads
    from osimlite.simulation.elements.external_loads import build_external_loads

    if not isinstance(external_loads, str | Path):
        raise SettingError(
            "`applied_to` assigns the columns of a table to bodies; pass the table as `external_loads`"
        )
    return build_external_loads(external_loads, applied_to)


def add_forces(
    model: Model, forces: Iterable[str | Path | Force], *, replace: bool = False
) -> None:
    """Add forces to a model, from files of ForceSets or as objects.

    Args:
        model: the model, which is changed.
        forces: files, or forces, which are copied.
        replace: whether the model's own forces are removed first.

    Raises:
        DocumentError: a file is missing or not a ForceSet.
    """
    from osimlite.io.document.reader import read_document
    from osimlite.io.document.source import Source

    # Replaced forces leave before new ones of the same names come.
    if replace:
        model.force_set.objects.clear()
    for force_or_path in forces:
        if isinstance(force_or_path, Force):
            # A copy, as an object has one owner and the caller keeps theirs.
            model.force_set.objects.append(force_or_path.copy_deep())
            continue
        force_set = read_document(Source.from_file(force_or_path), expected_class=ForceSet).top
        assert isinstance(force_set, ForceSet)
        for force in list(force_set.objects):
            model.force_set.objects.append(force)


def prepare_motion(
    mechanism: Mechanism,
    motion: MotionSource,
    times: ArrayLike | None,
    assemble: bool,
    lowpass: float | None,
    start: float,
    end: float,
) -> RecordedMotion:
    """Return the selected part of a motion, filtered and assembled as requested.

    Args:
        mechanism: the mechanism.
        motion: the motion, see :func:`kinematics`.
        times: times of arrays (t,), s.
        assemble: whether each pose is moved to the nearest one that fulfils the constraints.
        lowpass: frequency of the filter, Hz; None for no filter.
        start: first time, s.
        end: last time, s.

    Returns:
        The part of the motion, which keeps the other rows so that derivatives at its ends are those
        of the complete motion.

    Raises:
        SettingError: no time lies between the first and the last.
    """
    recorded = RecordedMotion.from_source(mechanism, motion, times)
    # As in OpenSim, the complete record is filtered before a part is selected.
    if lowpass is not None:
        recorded = recorded.apply_lowpass(lowpass)
    if not (start <= recorded.times[-1] and end >= recorded.times[0]):
        message = f"the motion has no row {format_time_span(start, end)}"
        raise SettingError(
            f"{message}; its rows go from {recorded.times[0]:g} to {recorded.times[-1]:g} s"
        )
    if start > -np.inf or end < np.inf:
        recorded = recorded.select_times(start, end)
    return recorded.assemble_poses() if assemble else recorded
