"""Initial states of simulations: values and speeds as users write them, states in files, earlier runs."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from osimlite.base.quantity import Quantity, describe_unit_mistake, parse_quantity
from osimlite.base.text import join_words
from osimlite.errors import DocumentError, SettingError
from osimlite.io.tables.storage import StoTable, read_sto
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.schema.tree import is_a

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.parts import CoordinateInfo
    from osimlite.schema.model import Model
    from osimlite.simulation.trajectory import Trajectory


def convert_value(
    mechanism: Mechanism, name: str, value: float | str, *, is_speed: bool = False
) -> float:
    """Convert a value or speed of a coordinate to SI units.

    Args:
        mechanism: the mechanism.
        name: name or path of the coordinate.
        value: a number in rad or m, or a text such as ``"30deg"`` with or without a unit.
        is_speed: whether the value is a speed, for messages.

    Returns:
        The number in rad or m (per second for a speed).

    Raises:
        ModelError: there is no such coordinate.
        SettingError: the text is not a quantity, or its unit does not fit the coordinate.
    """
    motion_type = mechanism.coordinates[mechanism.coordinate_index(name)].motion_type
    if not isinstance(value, str):
        try:
            return float(value)
        except (TypeError, ValueError):
            quantity = None
    else:
        quantity = parse_quantity(value)
    if quantity is None:
        raise SettingError(
            f"coordinate '{name}' takes a number such as 0.5 or 30deg, not '{value}'"
        )
    # A coupled coordinate of a CustomJoint may be an angle or a length; both units are accepted.
    if (
        quantity.unit is not None
        and motion_type != "coupled"
        and quantity.is_angle != (motion_type == "rotational")
    ):
        units = ("deg", "rad") if motion_type == "rotational" else ("m", "cm", "mm")
        *first_units, last_unit = (f"{unit}/s" if is_speed else unit for unit in units)
        expected_units = f"{', '.join(first_units)} or {last_unit}"
        subject = f"the speed of coordinate '{name}'" if is_speed else f"coordinate '{name}'"
        raise SettingError(f"{subject} is {motion_type}: give '{value}' in {expected_units}")
    return quantity.value


def describe_suspect_value(info: CoordinateInfo, name: str, value: float | str) -> str:
    """Return a warning if a value in radians was probably meant in degrees.

    Args:
        info: the coordinate.
        name: name of the coordinate in the message.
        value: value in rad or m, or a text with a unit.

    Returns:
        A sentence, or "" if the value is plausible.
    """
    if info.motion_type == "translational":
        return ""
    return describe_unit_mistake(
        name,
        parse_quantity(value) if isinstance(value, str) else Quantity(float(value), None),
        info.range,
    )


def convert_state(path: str, value: float | str) -> float:
    """Return the value of a state that has no unit as a number.

    Args:
        path: path of the state.
        value: a number, or a text.

    Raises:
        SettingError: the text is not a number.
    """
    try:
        return float(value)
    except (TypeError, ValueError):
        raise SettingError(f"the state '{path}' takes a number, not '{value}'") from None


def find_suspect_activations(initial: Mapping[str, float | str]) -> dict[str, float]:
    """Return the activations that are outside 0 to 1.

    Args:
        initial: values by the paths of states and the names of coordinates.

    Returns:
        Values of these activations by the paths of their states.
    """
    activations = {
        path: convert_state(path, value)
        for path, value in initial.items()
        if path.endswith("/activation")
    }
    return {path: value for path, value in activations.items() if not 0.0 <= value <= 1.0}


def describe_suspect_activations(model: Model, suspect_values: Mapping[str, float]) -> str:
    """Return a warning if activations of muscles are outside 0 to 1, which OpenSim accepts.

    Args:
        model: the model.
        suspect_values: values outside 0 to 1 by the paths of states.

    Returns:
        A sentence, or "" if none of them belongs to a muscle.
    """
    tree = model.tree()
    # Activations of other actuators, as of an ActivationCoordinateActuator, have no such range.
    muscles = [
        f"'{path}' = {value:g}"
        for path, value in suspect_values.items()
        if is_a(tree.find(path.rpartition("/")[0]), "Muscle")
    ]
    return (
        f"activations of muscles are 0 to 1, but the initial value is {join_words(muscles, max_count=3)}"
        if muscles
        else ""
    )


def resolve_initial_values(
    mechanism: Mechanism, initial: Mapping[str, float], speeds: Mapping[str, float]
) -> tuple[list[float], list[float], list[list[int]]]:
    """Return the initial values and speeds of all coordinates, before constraints are enforced.

    Args:
        mechanism: the mechanism.
        initial: values (rad, m) by name or path. Constraints may change a value whose key is a path
            with ``/value`` or ``/speed``; the others stay.
        speeds: generalized speeds by name or path.

    Returns:
        Values (n,) and speeds (n,) of all coordinates, and two lists of indices: of the coordinates
        whose values stay, and of those whose speeds stay.

    Raises:
        ModelError: there is no such coordinate.
        SettingError: a coordinate is set twice, locked or prescribed, or a number is not finite.
    """
    infos = mechanism.coordinates
    q = [info.default_value for info in infos]
    u = [info.default_speed for info in infos]
    remaining = dict(initial)
    # Paths of states come from files. They may name locked coordinates, and constraints may change
    # them, so they are only a guess.
    for index, info in enumerate(infos):
        for row, quantity in ((q, "value"), (u, "speed")):
            initial_value = remaining.pop(f"{info.path}/{quantity}", None)
            if initial_value is not None:
                row[index] = _check_finite(initial_value, quantity, info.path)
    set_indices: list[list[int]] = []
    for numbers, row, quantity in ((remaining, q, "value"), (speeds, u, "speed")):
        set_indices.append([])
        for name, value in numbers.items():
            index = mechanism.coordinate_index(name)
            if index in set_indices[-1]:
                raise SettingError(
                    f"coordinate '{name}' is set twice, by its name and by its path; leave one out"
                )
            if infos[index].locked:
                raise SettingError(
                    f"coordinate '{name}' is locked at {infos[index].default_value:g}, so its {quantity} cannot "
                    "be set; unlock it in the model"
                )
            if infos[index].prescribed is not None:
                raise SettingError(
                    f"coordinate '{name}' is prescribed, so its {quantity} cannot be set; "
                    "set its prescribed to false in the model"
                )
            row[index] = _check_finite(value, quantity, name)
            set_indices[-1].append(index)
    return q, u, set_indices


def _check_finite(value: float, quantity: str, name: str) -> float:
    """Return a number as a float after checking that it is finite.

    Raises:
        SettingError: the number is infinite or NaN.
    """
    if not isfinite(value):
        raise SettingError(f"the {quantity} of coordinate '{name}' is {value}; give a number")
    return float(value)


def match_state_columns(labels: Sequence[str], paths: Iterable[str]) -> dict[str, int]:
    """Find the column of each state, as OpenSim's TableUtilities does.

    A label is the path of the state, the end of that path, or the name before OpenSim 4: ``knee``,
    ``knee_u``, ``soleus.activation``.

    Args:
        labels: labels of the columns.
        paths: paths of the states.

    Returns:
        Indices of columns by the paths of the states that have one.
    """
    first_columns: dict[str, int] = {}
    for index, label in enumerate(labels):
        first_columns.setdefault(label, index)
    result = {}
    for path in paths:
        path_steps = path.strip("/").split("/")
        owner, quantity = path_steps[-2], path_steps[-1]
        # Names of states before OpenSim 4: knee_angle, knee_angle_u, soleus.activation.
        old_label = {"value": owner, "speed": f"{owner}_u"}.get(quantity, f"{owner}.{quantity}")
        path_ends = ("/".join(path_steps[k:]) for k in range(len(path_steps)))
        # The longest name wins: a path before its ends, and all of them before names of old
        # versions.
        column = next(
            (
                first_columns[label]
                for label in (path, *path_ends, old_label)
                if label in first_columns
            ),
            None,
        )
        if column is not None:
            result[path] = column
    return result


def read_state(
    path: str | Path, mechanism: Mechanism, names: Collection[str], time: float | None = None
) -> dict[str, float]:
    """Return one state of a file by the paths of the states.

    Args:
        path: file with a table of states; columns that are not states are ignored.
        mechanism: the mechanism to which the states belong.
        names: paths of all states, see :func:`match_state_columns`.
        time: time of the state, s; the nearest row is used. The last row if None.

    Returns:
        Values in SI units (rad, m) by path.

    Raises:
        DocumentError: the file is not a table, has no states of the mechanism, or no rows.
    """
    return extract_state(read_sto(path), mechanism, names, time)


def extract_state(
    table: StoTable, mechanism: Mechanism, names: Collection[str], time: float | None = None
) -> dict[str, float]:
    """Return one state of a table by the paths of the states; see :func:`read_state`.

    Args:
        table: the table of states.
        mechanism: the mechanism to which the states belong.
        names: paths of all states.
        time: time of the state, s; the nearest row is used. The last row if None.

    Returns:
        Values in SI units (rad, m) by path.

    Raises:
        DocumentError: the table has no states of the mechanism, or no rows.
    """
    columns = match_state_columns(table.columns, names)
    if not columns or not len(table.times):
        missing = (
            f"column is a state of '{mechanism.name}', such as '{next(iter(names), '')}'"
            if not columns
            else "row"
        )
        raise DocumentError(f"no {missing}; give a file of its states", file=table.file)
    # The nearest row, not an interpolated one, whose states would fulfil no equilibrium.
    row = table.rows[-1 if time is None else int(np.argmin(np.abs(table.times - time)))].tolist()
    rotational = {info.path for info in mechanism.coordinates if info.motion_type == "rotational"}
    return {
        path: float(np.radians(row[column]))
        if table.in_degrees and path.rpartition("/")[0] in rotational
        else row[column]
        for path, column in columns.items()
    }


def read_earlier_run(run: str | Path | Trajectory) -> tuple[StoTable, StoTable | None]:
    """Return the states of an earlier run and the record of its controller.

    Args:
        run: the trajectory of the run, or the folder with its results.

    Returns:
        The table of states, and the table of the controller (None without one).

    Raises:
        OsimliteError: the folder has no states.
    """
    if not isinstance(run, str | Path):
        return run.states, run.controller
    controller_path = Path(run) / "controller.sto"
    return read_sto(Path(run) / "states.sto"), read_sto(
        controller_path
    ) if controller_path.exists() else None
