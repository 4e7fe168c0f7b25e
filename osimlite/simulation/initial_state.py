"""Where a simulation starts: values and speeds of coordinates as people give them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from osimlite.base.quantity import Quantity, describe_unit_doubt, parse_quantity
from osimlite.errors import DocumentError, SettingError, SimulationError
from osimlite.io.tables.storage import StoTable, read_sto
from osimlite.mechanics.multibody.mechanism import Mechanism

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.parts import CoordinateInfo
    from osimlite.simulation.trajectory import Trajectory


def in_units_of(mechanism: Mechanism, name: str, given: float | str) -> float:
    """A value or speed of a coordinate in rad or m (per second); a text such as ``"30deg"`` may carry a unit.

    Raises:
        ModelError: there is no such coordinate.
        SettingError: the text is no quantity, or its unit does not fit the coordinate.
    """
    kind = mechanism.coordinates[mechanism.coordinate_index(name)].motion_type
    if not isinstance(given, str):
        return float(given)
    read = parse_quantity(given)
    if read is None:
        raise SettingError(
            f"coordinate '{name}' takes a number such as 0.5 or 30deg, not '{given}'"
        )
    if read.unit is not None and kind != "coupled" and read.is_angle != (kind == "rotational"):
        wanted = "deg or rad" if kind == "rotational" else "m, cm or mm"
        raise SettingError(f"coordinate '{name}' is {kind}: give '{given}' in {wanted}")
    return read.value


def suspect_value(info: CoordinateInfo, name: str, given: float | str) -> str:
    """What is odd about a value as people give it: degrees that are taken for radians.

    Args:
        info: of the coordinate.
        name: what it was called.
        given: rad or m, or a text with a unit.

    Returns:
        A sentence, or "" if there is nothing odd.
    """
    if info.motion_type == "translational":
        return ""
    return describe_unit_doubt(
        name,
        parse_quantity(given) if isinstance(given, str) else Quantity(float(given), None),
        info.range,
    )


def starting(
    mechanism: Mechanism, initial: Mapping[str, float], speeds: Mapping[str, float]
) -> tuple[list[float], list[float], list[list[int]]]:
    """Where the coordinates start.

    Args: mechanism: whose coordinates. initial: values (rad, m) by name or path; a path with
        ``/value`` or ``/speed`` behind it says where the coordinate starts as far as constraints
        let it. speeds: generalized speeds by name or path.

    Returns: Values and speeds of all coordinates, the places of those whose values stay as they
        are, and of those whose speeds do.

    Raises: ModelError: there is no such coordinate. SimulationError: a coordinate is locked or
        prescribed, or set twice, or a number is not finite.
    """
    infos = mechanism.coordinates
    q, u = [info.default_value for info in infos], [info.default_speed for info in infos]
    named = dict(initial)
    for place, info in enumerate(infos):
        for row, what in ((q, "value"), (u, "speed")):
            given = named.pop(f"{info.path}/{what}", None)
            if given is not None:
                row[place] = _number(given, what, info.path)
    places: list[list[int]] = []
    for numbers, row, what in ((named, q, "value"), (speeds, u, "speed")):
        places.append([])
        for name, value in numbers.items():
            place = mechanism.coordinate_index(name)
            if place in places[-1]:
                raise SettingError(
                    f"coordinate '{name}' is set twice, by its name and by its path; leave one out"
                )
            if infos[place].locked:
                raise SimulationError(
                    f"coordinate '{name}' is locked at {infos[place].default_value:g}, so that its {what} cannot "
                    "be set; unlock it in the model"
                )
            if infos[place].prescribed is not None:
                raise SimulationError(
                    f"coordinate '{name}' is prescribed, so that its {what} cannot be set; "
                    "set its prescribed to false in the model"
                )
            row[place] = _number(value, what, name)
            places[-1].append(place)
    return q, u, places


def _number(value: float, what: str, name: str) -> float:
    if not isfinite(value):
        raise SettingError(f"the {what} of coordinate '{name}' is {value}; give a number")
    return float(value)


def columns_of_states(labels: Sequence[str], paths: Iterable[str]) -> dict[str, int]:
    """Which column has which state, as OpenSim's TableUtilities find it.

    A label is the path of the state, the end of it, or what it was called before OpenSim 4:
    ``knee``, ``knee_u``, ``soleus.activation``.

    Args:
        labels: of the columns.
        paths: of the states.

    Returns:
        The places of the columns by the paths of those states that have one.
    """
    places: dict[str, int] = {}
    for index, label in enumerate(labels):
        places.setdefault(label, index)
    result = {}
    for path in paths:
        parts = path.strip("/").split("/")
        owner, what = parts[-2], parts[-1]
        old = {"value": owner, "speed": f"{owner}_u"}.get(what, f"{owner}.{what}")
        ends = ("/".join(parts[k:]) for k in range(len(parts)))
        column = next((places[label] for label in (path, *ends, old) if label in places), None)
        if column is not None:
            result[path] = column
    return result


def state_in(
    path: str | Path, mechanism: Mechanism, names: Collection[str], time: float | None = None
) -> dict[str, float]:
    """A state of a file, by the paths of its columns; columns that are no states are left out.

    Args:
        path: of a table of states.
        mechanism: whose states they are.
        names: paths of all states, see :func:`columns_of_states`.
        time: of the row that is taken, the nearest in the file, s; the last one if left out.

    Raises:
        DocumentError: it is no table, has no states of the mechanism, or no rows.
    """
    return state_at(read_sto(path), mechanism, names, time)


def state_at(
    table: StoTable, mechanism: Mechanism, names: Collection[str], time: float | None = None
) -> dict[str, float]:
    """A state of a table; see `state_in`."""
    columns = columns_of_states(table.columns, names)
    if not columns or not len(table.times):
        what = (
            f"column is a state of '{mechanism.name}', such as '{next(iter(names), '')}'"
            if not columns
            else "row"
        )
        raise DocumentError(f"no {what}; give a file of its states", file=table.file)
    row = table.rows[-1 if time is None else int(np.argmin(np.abs(table.times - time)))].tolist()
    turning = {info.path for info in mechanism.coordinates if info.motion_type == "rotational"}
    return {
        path: float(np.radians(row[place]))
        if table.in_degrees and path.rpartition("/")[0] in turning
        else row[place]
        for path, place in columns.items()
    }


def ended(given: str | Path | Trajectory) -> tuple[StoTable, StoTable | None]:
    """The states of a run, and what was recorded of its controller, from its folder or itself.

    Raises:
        OsimliteError: there are no states.
    """
    if not isinstance(given, str | Path):
        return given.states, given.controller
    table = Path(given) / "controller.sto"
    return read_sto(Path(given) / "states.sto"), read_sto(table) if table.exists() else None
