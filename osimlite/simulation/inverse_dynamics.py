"""What follows from a recorded motion, in one call: where bodies and markers are, and the forces that it takes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.records import dataclass, field
from osimlite.errors import SettingError
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.schema.forces import Force, ForceSet
from osimlite.schema.model import Model
from osimlite.simulation.elements import force_elements
from osimlite.simulation.recorded_motion import (
    Recorded,
    RecordedMotion,
    exclude_forces,
    excluded_forces,
)

if TYPE_CHECKING:
    from osimlite.schema.prescribed import ExternalLoads


@dataclass(frozen=True, eq=False)
class GeneralizedForces(StoTable):
    """A column (N or N·m) for each coordinate, and the motion that takes these forces."""

    motion: RecordedMotion | None = field(default=None, repr=False)


def kinematics(
    model: Model,
    motion: Recorded,
    *,
    times: ArrayLike | None = None,
    assemble: bool = False,
    lowpass: float | None = None,
    start: float = -np.inf,
    end: float = np.inf,
) -> RecordedMotion:
    """Follow a motion: its ``bodies()`` and ``markers()`` are tables of where these are, itself of the coordinates.

    Args: model: that moves. motion: a .mot or .sto file; a motion, such as a fitted one or a
        trajectory; or arrays (t,) in rad and m by the names or paths of coordinates. times: of
        arrays (t,), s. assemble: whether each pose is changed as little as the model's constraints
        demand first. lowpass: Hz of OpenSim's filter of the coordinates, if there is to be one.
        start: first time, s. end: last time, s.

    Raises: OsimliteError: it is no motion of the model. SettingError: no time lies between the
        first and the last, or the filter does not fit the times. SimulationError: a pose is too far
        from fulfilling the constraints.
    """
    return followed(build_mechanism(model), motion, times, assemble, lowpass, start, end)


def inverse_dynamics(
    model: Model,
    motion: Recorded,
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
    """The generalized forces (N, N·m) that a motion takes beyond gravity, measured loads and the forces of the model.

    Args: model: that moves. motion: as of :func:`kinematics`. external_loads: measured loads or
        their file; with `applied_to` a table (.mot, .sto, .c3d) in the axes of ground. times: of
        arrays (t,), s. applied_to: of such a table, by the names of bodies, for each load on one
        what the labels of its force, point and moment begin with: ``{"calcn_r": [("f1_", "p1_",
        "m1_")]}``. exclude: what does not push: names of forces or groups, "All", "Actuators" or
        "Muscles". lowpass: Hz of OpenSim's filter of the coordinates, if there is to be one. start:
        first time, s. end: last time, s. wrapping: how paths bend around surfaces, see
        :class:`osimlite.simulation.Options`. opensim_derivatives: whether the mistakes of OpenSim's
        CustomJoints are repeated. folder: where the model's file is, for the files that it names;
        the folder that the program runs in if None.

    Returns: A column for each coordinate; those of ball and free joints are moments about axes of
        the parent frame.

    Raises: OsimliteError: it is no motion of the model, or loads cannot be read. SettingError: no
        time lies between the first and the last, there are too few, or a name is none.
        UnsupportedError: a force of the model cannot be computed.
    """
    external_loads = loads_of(external_loads, applied_to)
    excluded, pushed = [*exclude], model
    if excluded_forces(model, excluded):
        pushed = model.copy_deep()
        exclude_forces(pushed, excluded)
    mechanism = build_mechanism(pushed, opensim_derivatives=opensim_derivatives)
    recorded = followed(mechanism, motion, times, False, lowpass, start, end)
    forces = force_elements(
        pushed, mechanism, wrapping=wrapping, external_loads=external_loads, folder=folder
    )
    table = recorded.inverse_dynamics(forces)
    return GeneralizedForces(table.name, table.times, table.columns, table.rows, motion=recorded)


def loads_of(
    external_loads: str | Path | ExternalLoads | None,
    applied_to: Mapping[str, Sequence[Sequence[str]]] | None,
) -> str | Path | ExternalLoads | None:
    """The loads, also where they are a table of which `applied_to` says what it pushes; see :func:`inverse_dynamics`.

    Raises:
        SettingError: there is no table.
    """
    if not applied_to:
        return external_loads
    from osimlite.simulation.elements.external_loads import build_external_loads

    if not isinstance(external_loads, str | Path):
        raise SettingError(
            "applied_to says what the columns of a table push; name the table as external_loads"
        )
    return build_external_loads(external_loads, applied_to)


def add_forces(
    model: Model, forces: Iterable[str | Path | Force], *, replace: bool = False
) -> None:
    """Give a model more forces, from files of ForceSets, or others in the place of its own.

    Raises:
        DocumentError: a file is missing, or no ForceSet.
    """
    from osimlite.io.document.reader import read_document
    from osimlite.io.document.source import Source

    if replace:
        model.force_set.objects.clear()
    for each in forces:
        if isinstance(each, Force):
            model.force_set.objects.append(each.copy_deep())
            continue
        more = read_document(Source.of_file(each), of=ForceSet).top
        assert isinstance(more, ForceSet)
        for force in list(more.objects):
            model.force_set.objects.append(force)


def followed(
    mechanism: Mechanism,
    motion: Recorded,
    times: ArrayLike | None,
    assemble: bool,
    lowpass: float | None,
    start: float,
    end: float,
) -> RecordedMotion:
    """The part of a motion that counts, filtered and assembled if it is to be; see :func:`kinematics`."""
    recorded = RecordedMotion.of(mechanism, motion, times)
    if lowpass is not None:
        recorded = recorded.lowpassed(lowpass)
    if not (start <= recorded.times[-1] and end >= recorded.times[0]):
        message = f"no time of the motion lies between {start:g} and {end:g} s"
        raise SettingError(
            f"{message}; it is from {recorded.times[0]:g} to {recorded.times[-1]:g} s"
        )
    if start > -np.inf or end < np.inf:
        recorded = recorded.between(start, end)
    return recorded.assembled() if assemble else recorded
