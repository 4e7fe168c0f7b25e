"""Plots of the tables that tools write: motions, moments, muscle forces, states, controls and errors."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from math import isfinite
from pathlib import Path, PurePath

import numpy as np

from osimlite.base.files import make_folder
from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.parts import CoordinateInfo
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.actuators import CoordinateActuator, TorqueActuator
from osimlite.schema.forces import Actuator, ScalarActuator
from osimlite.schema.model import Model
from osimlite.schema.muscles import PathActuator
from osimlite.schema.paths import GeometryPath
from osimlite.view.bands import Band, check_bands
from osimlite.view.panel_groups import (
    FRACTION,
    MULTIPLE,
    Column,
    StepTimes,
    group_columns,
    split_sides,
)
from osimlite.view.panels import draw_pages, has_cycles, write_pages

FORCE, MOMENT, POWER = "N", "N·m", "W"
FORCE_OR_MOMENT = "N or N·m"
"""Unit of an actuator of unknown type."""

SPEED = "m/s or rad/s"
"""Unit of the speed of an actuator of unknown type."""

ACTIVATIONS = "Static Optimization"
"""First line of tables of activations, which have the controls of other actuators too."""

ACTUATOR_TABLES = (
    "ActuatorForces",
    "ActuatorSpeeds",
    "ActuatorPowers",
    "ModelForces",
    "controls",
    ACTIVATIONS,
)
"""First lines of tables whose columns have the names of actuators and other forces."""

TABLE_UNITS = {
    "ActuatorPowers": POWER,
    "ActuatorSpeeds": SPEED,
    "controls": MULTIPLE,
    ACTIVATIONS: MULTIPLE,
    "ActuatorForces": FORCE_OR_MOMENT,
    "ModelForces": FORCE_OR_MOMENT,
    "Length": "m",
    "FiberLength": "m",
    "TendonLength": "m",
    "FiberVelocity": "m/s",
    "FiberForce": FORCE,
    "TendonForce": FORCE,
    "ActiveFiberForce": FORCE,
    "PassiveFiberForce": FORCE,
    "ActiveFiberForceAlongTendon": FORCE,
    "PassiveFiberForceAlongTendon": FORCE,
    "FiberActivePower": POWER,
    "FiberPassivePower": POWER,
    "TendonPower": POWER,
    "MusclePower": POWER,
    "MuscleActuatorPower": POWER,
    "PennationAngle": "rad",
    "PennationAngularVelocity": "rad/s",
    "NormalizedFiberLength": "× optimal length",
    "NormFiberVelocity": "× maximal speed",
    "PointPosition": "m",
    "PointVelocity": "m/s",
    "PointAcceleration": "m/s²",
    "marker errors": "m",
    "orientation errors": "rad",
}
"""Units of tables whose columns have one unit, by their first lines."""

LABEL_UNITS = {"total_squared_error": "m²", "marker_error_RMS": "m", "marker_error_max": "m"}
"""Units of the columns that OpenSim's inverse kinematics reports."""

ACRONYMS = {"cmc", "grf", "id", "ik", "rra", "so"}
"""Words in names of files that are written in capitals in titles."""

TITLES = (
    (r"StaticOptimization_activation", "Activations"),
    (r"StaticOptimization_force", "Forces"),
    (r"Actuation_force", "Forces of actuators"),
    (r"Actuation_speed", "Speeds of actuators"),
    (r"Actuation_power", "Powers of actuators"),
    (r"BodyKinematics_pos_(?:global|bodyLocal)", "Positions of bodies"),
    (r"BodyKinematics_vel_(?:global|bodyLocal)", "Velocities of bodies"),
    (r"BodyKinematics_acc_(?:global|bodyLocal)", "Accelerations of bodies"),
    (r"PointKinematics_(?P<name>.+)_pos", r"Position of \g<name>"),
    (r"PointKinematics_(?P<name>.+)_vel", r"Velocity of \g<name>"),
    (r"PointKinematics_(?P<name>.+)_acc", r"Acceleration of \g<name>"),
    (r"Kinematics_q", "Coordinates"),
    (r"Kinematics_u", "Speeds of coordinates"),
    (r"Kinematics_dudt", "Accelerations of coordinates"),
    (r"JointReaction_ReactionLoads", "Loads at joints"),
    (r"MuscleAnalysis_MomentArm_(?P<name>.+)", r"Moment arms about \g<name>"),
    (r"MuscleAnalysis_Moment_(?P<name>.+)", r"Moments of muscles about \g<name>"),
    (r"MuscleAnalysis_Length", "Lengths of muscles and tendons"),
    (r"MuscleAnalysis_(?P<name>.+)", r"\g<name>"),
)
"""Ends of the names of files that analyses of OpenSim write, and titles of their pages."""

STATE_UNITS = {
    "fiber_length": "m",
    "fiber_velocity": "m/s",
    "stretch": "m",
    "dissipatedEnergy": "J",
}
"""Units of states of forces that have one, by the last word of their paths."""

SECTIONS = {
    "value": "values",
    "speed": "speeds",
    "activation": "activations",
    "fiber_length": "fiber lengths",
}
"""Titles of the pages of states, by the last word of their paths."""

RATE_UNITS = ("", "/s", "/s²")
"""Ends of the units of positions, velocities and accelerations."""

_RATES = {
    "Speeds": 1,
    "Velocities": 1,
    "PointVelocity": 1,
    "Accelerations": 2,
    "PointAcceleration": 2,
}
"""Order of the time derivative of tables of motion, by their first lines."""


class ColumnNames(NamedTuple):
    """Units, groups and limits of table columns that follow from a model."""

    coordinates: Mapping[str, CoordinateInfo]  # coordinates by name
    units: Mapping[str, str]  # units of the forces of actuators by name
    regions: Mapping[str, str]  # bodies between which muscles run, by name
    control_limits: Mapping[str, tuple[float, ...]] = {}  # least and largest control, by name
    force_limits: Mapping[str, tuple[float, ...]] = {}  # forces at these controls, by name

    @classmethod
    def from_model(cls, model: Model | None, mechanism: Mechanism | None = None) -> ColumnNames:
        """Return the names of a model; those that need a missing model or mechanism are left out.

        Args:
            model: model with the actuators that a tool has added; None if it is unknown.
            mechanism: mechanism of the model, for the coordinates; None if it is unknown.
        """
        infos = (
            {coordinate.name: coordinate for coordinate in mechanism.coordinates}
            if mechanism
            else {}
        )
        units, regions = dict[str, str](), dict[str, str]()
        controls, forces = dict[str, tuple[float, ...]](), dict[str, tuple[float, ...]]()
        for actuator in model.components(Actuator) if model is not None else ():
            if isinstance(actuator, ScalarActuator):
                bounds = actuator.min_control, actuator.max_control
                controls[actuator.name] = tuple(limit for limit in bounds if isfinite(limit))
                # The force at full activation also depends on length and speed of the fibers.
                strongest = getattr(actuator, "max_isometric_force", None)
                scale = getattr(actuator, "optimal_force", 0.0)
                forces[actuator.name] = (
                    (strongest,)
                    if strongest is not None
                    else tuple(scale * limit for limit in controls[actuator.name] if scale * limit)
                )
            if isinstance(actuator, PathActuator):
                units[actuator.name] = FORCE
                regions[actuator.name] = _describe_region(actuator)
            elif isinstance(actuator, CoordinateActuator):
                coordinate = infos.get(str(actuator.coordinate))
                # An unknown coordinate is taken for an angle.
                is_rotational = coordinate is None or coordinate.motion_type == "rotational"
                units[actuator.name] = MOMENT if is_rotational else FORCE
            else:
                units[actuator.name] = MOMENT if isinstance(actuator, TorqueActuator) else FORCE
        return cls(infos, units, regions, controls, forces)


def _describe_region(actuator: PathActuator) -> str:
    """Return the bodies between which a muscle runs, without their side; "" without points."""
    path = actuator.geometry_path
    if not isinstance(path, GeometryPath) or not path.path_point_set.objects:
        return ""
    points = path.path_point_set.objects
    frames = [points[index].socket_parent_frame for index in (0, -1)]
    body_names = [str(getattr(frame, "name", frame)).rpartition("/")[2] for frame in frames]
    # Muscles of both legs belong to one region, though the names of bodies say a side.
    stems = [next(iter(split_sides([end]).values()))[0] for end in body_names]
    return " – ".join(dict.fromkeys(stems)).replace("_", " ")


def describe_columns(table: StoTable, names: ColumnNames) -> list[Column]:
    """Return the columns of a table with their units and groups; angles are in degrees.

    Args:
        table: table to describe.
        names: names and units from the model.
    """
    columns: dict[str, list[Column]] = {}
    for label, values in table.table[1].items():
        column = _describe_column(label, np.asarray(values, dtype=float), table, names)
        # Values, speeds, activations and so on of a table of states come one after the other.
        quantity = _find_quantity(label)
        section = SECTIONS.get(quantity, quantity.replace("_", " "))
        column = column._replace(section=section)
        if section == SECTIONS["activation"]:
            column = column._replace(unit=FRACTION, y_range=(0.0, 1.0))
        columns.setdefault(quantity, []).append(column)
    all_columns = [column for group in columns.values() for column in group]
    groups = split_sides(column.group for column in all_columns)
    return [column._replace(group=groups[column.group][0]) for column in all_columns]


def _find_quantity(label: str) -> str:
    """Return the kind of a state by its label; "" for columns that are no states."""
    owner, _, quantity = label.rpartition("/")
    # Labels of states are paths; those of older files have dots.
    if owner:
        return quantity
    ending = label.partition(".")[2]
    return ending if ending in SECTIONS or ending in STATE_UNITS else ""


def _describe_column(label: str, values: Array, table: StoTable, names: ColumnNames) -> Column:
    owner, _, last = label.rpartition("/")
    if owner:
        component = owner.rpartition("/")[2]
        if last in ("value", "speed"):
            return _describe_coordinate(component, values, table, names, last == "speed")
        return Column(
            component if last in SECTIONS else f"{component} {last.replace('_', ' ')}",
            STATE_UNITS.get(last, ""),
            values,
            names.regions.get(component, ""),
        )
    # Files of OpenSim 3 have "soleus_r.activation".
    component, _, last = label.partition(".")
    if last in ("activation", *STATE_UNITS):
        column_name = component if last in SECTIONS else f"{component} {last.replace('_', ' ')}"
        return Column(
            column_name, STATE_UNITS.get(last, ""), values, names.regions.get(component, "")
        )
    # Labels that end with a component are vectors even in tables of actuators.
    is_vector = any(pattern.fullmatch(label) for pattern in _VECTORS)
    if table.name in ACTUATOR_TABLES and not is_vector:
        # Actuators of a coordinate often have its name.
        return _describe_actuator(label, values, table, names)
    if label in names.coordinates:
        return _describe_coordinate(label, values, table, names, False)
    # OpenSim's tables of states of version 3 have speeds as "<coordinate>_u".
    if label.endswith("_u") and label[:-2] in names.coordinates:
        return _describe_coordinate(label[:-2], values, table, names, True)
    for pattern, describe in _ENDINGS:
        if match := pattern.fullmatch(label):
            unit = describe(match["end"], table)
            base_name = match["stem"]
            group = _find_group(base_name, names)
            column_name = f"{base_name} {match['end']}" if pattern in _VECTORS else base_name
            factor = 1.0
            if unit.startswith("rad"):
                factor = np.degrees(1.0)
                unit = unit.replace("rad", "deg", 1)
            return Column(column_name, unit, factor * values, group)
    unit = LABEL_UNITS.get(label, TABLE_UNITS.get(table.name, ""))
    if table.name.startswith("MomentArm_"):
        unit = "m"
    elif table.name.startswith("Moment_"):
        unit = MOMENT
    factor = 1.0
    if unit.startswith("rad"):
        factor = np.degrees(1.0)
        unit = unit.replace("rad", "deg", 1)
    return Column(label, unit, factor * values, names.regions.get(label, ""))


def _describe_actuator(label: str, values: Array, table: StoTable, names: ColumnNames) -> Column:
    """Return the column of an actuator or another force, by the name of the actuator."""
    group = names.regions.get(label, "")
    # Reserve actuators are named after their coordinate.
    coordinate = names.coordinates.get(re.sub(r"_reserve$|^reserve_", "", label))
    group = group or ("" if coordinate is None else _find_group(coordinate.name, names))
    is_rotational = coordinate is None or coordinate.motion_type == "rotational"
    force = names.units.get(label, "" if coordinate is None else MOMENT if is_rotational else FORCE)
    unit = TABLE_UNITS[table.name]
    if unit == FORCE_OR_MOMENT:
        unit = force or unit
    elif unit == SPEED:
        unit = {FORCE: "m/s", MOMENT: "rad/s"}.get(force, unit)
    elif unit == MULTIPLE:
        if label in names.regions:
            return Column(label, FRACTION, values, group, y_range=(0.0, 1.0))
        # Without a model, a muscle cannot be distinguished from another actuator.
        unit = MULTIPLE if label in names.units else ""
    return Column(label, unit, values, group)


def _describe_coordinate(
    name: str, values: Array, table: StoTable, names: ColumnNames, is_speed: bool
) -> Column:
    """Return the column of a coordinate, in degrees if it is an angle."""
    coordinate = names.coordinates.get(name)
    end = RATE_UNITS[1 if is_speed else _RATES.get(table.name, 0)]
    motion_type = coordinate.motion_type if coordinate is not None else ""
    unit = {"rotational": "deg", "translational": "m"}.get(motion_type, "")
    if motion_type == "rotational" and not table.in_degrees:
        values = np.degrees(values)
    return Column(name, f"{unit}{end}" if unit else "", values, _find_group(name, names))


def _find_group(name: str, names: ColumnNames) -> str:
    """Return the joint of a coordinate, or the body of a vector."""
    coordinate = names.coordinates.get(name)
    if coordinate is None:
        return name
    return re.sub(r"^ground_|_[rl]$", "", coordinate.joint.rpartition("/")[2])


def _describe_vector(end: str, table: StoTable) -> str:
    """Return the unit of a component of a body's position, velocity or acceleration."""
    rate = RATE_UNITS[_RATES.get(table.name, 0)]
    if not end.startswith("O"):
        return f"m{rate}"
    return f"{'deg' if table.in_degrees else 'rad'}{rate}"


_ENDINGS: tuple[tuple[re.Pattern[str], Callable[[str, StoTable], str]], ...] = (
    (compile_later(r"(?P<stem>.+)_(?P<end>moment)"), lambda end, table: MOMENT),
    (compile_later(r"(?P<stem>.+)_(?P<end>force)"), lambda end, table: FORCE),
    (compile_later(r"(?P<stem>.+)_(?P<end>O[xyzXYZ]|[XYZ])"), _describe_vector),
    (
        compile_later(r"(?P<stem>.+)_(?P<end>[fmp][xyz])"),
        lambda end, table: {"f": FORCE, "m": MOMENT, "p": "m"}[end[0]],
    ),
    (
        compile_later(r"(?P<stem>.+)_(?P<end>[FTp][xyz])"),
        lambda end, table: {"F": FORCE, "T": MOMENT, "p": "m"}[end[0]],
    ),
    (compile_later(r"(?P<stem>.+)\.(?P<end>force\.[XYZ])"), lambda end, table: FORCE),
    (compile_later(r"(?P<stem>.+)\.(?P<end>torque\.[XYZ])"), lambda end, table: MOMENT),
    (compile_later(r"(?P<stem>.+)\.?(?P<end>PotentialEnergy)"), lambda end, table: "J"),
)
"""Ends of labels, and the functions that return their units."""
_VECTORS = [pattern for pattern, _ in _ENDINGS[2:]]
"""Patterns whose ends distinguish quantities."""


def plot_tables(
    tables: Mapping[str, StoTable],
    folder: str | Path,
    names: ColumnNames,
    *,
    steps: Mapping[str, StepTimes] | None = None,
    report: Callable[[int, int], None] | None = None,
    bands: Mapping[str, Band] | None = None,
) -> list[Path]:
    """Draw tables over time or over the gait cycle, each on pages of at most twelve panels.

    Args:
        tables: tables by the names of their files, such as ``ik.mot``.
        folder: folder to write into; it is made if it does not exist.
        names: names and units from the model.
        steps: steps of the feet by side; None if they are unknown.
        report: called with the number of finished tables and the number of all.
        bands: reference bands by the title of their panel, drawn over the gait cycle.

    Returns:
        The PNG files; a table with fewer than two rows, or of constant columns only, has none.

    Raises:
        MissingDependency: matplotlib is not installed.
        OsimliteError: the folder or a file cannot be written.
        SettingError: no panel has a band, or none is over the gait cycle.
    """
    paths = []
    titles = list[str]()
    is_cyclic = False
    base = make_folder(Path(folder))
    for number, (name, table) in enumerate(tables.items(), 1):
        # A dot in the name of a tool is no ending.
        file_stem = re.sub(r"\.(sto|mot|xml|trc)$", "", PurePath(name).name)
        if len(table.times) > 1:
            panels, notes = group_columns(describe_columns(table, names), table.times, steps=steps)
            panels = [panel._replace(band=(bands or {}).get(panel.title)) for panel in panels]
            titles += [panel.title for panel in panels]
            is_cyclic = is_cyclic or has_cycles(panels)
            paths += write_pages(
                draw_pages(make_title(file_stem), panels, notes=notes), base, file_stem
            )
        if report is not None:
            report(number, len(tables))
    if bands:
        check_bands(bands, titles, cyclic=is_cyclic)
    return paths


def make_title(file_stem: str) -> str:
    """Return the title of a picture from the name of its file: the name of the tool, and the quantity."""
    for pattern, template in TITLES:
        if match := re.fullmatch(rf"(?:(?P<tool>.*)_)?{pattern}", file_stem):
            title = match.expand(template).replace("_", " ")
            # Quantities of muscles have names such as "NormFiberVelocity".
            if title in file_stem:
                title = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", title)
                title = title.lower().replace("norm ", "normalized ")
            if tool := match["tool"]:
                return f"{_capitalize_words(tool)}, {title[:1].lower()}{title[1:]}"
            return title[:1].upper() + title[1:]
    return _capitalize_words(file_stem)


def _capitalize_words(file_stem: str) -> str:
    """Return the words of the name of a file, with acronyms and the first letter in capitals."""
    title = file_stem.strip("_").replace("_", " ")
    words = [word.upper() if word in ACRONYMS else word for word in title.split(" ")]
    text = " ".join(words)
    return text[:1].upper() + text[1:]
