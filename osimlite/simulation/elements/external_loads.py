"""Measured forces: the ExternalLoads of a document and the columns of their data file (.sto, .mot, .c3d).

As in OpenSim, a column is a natural cubic spline through all its values, straight lines if it has
two or three values, and a constant if it has one. Outside its times a spline is extrapolated
linearly.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from osimlite.base.text import add_article, find_nearest, join_words
from osimlite.errors import DocumentError, ModelError, SettingError
from osimlite.io.document.cache import cache_by_file, read_object
from osimlite.io.tables.c3d import ENDING, read_c3d_forces
from osimlite.io.tables.storage import (
    StoTable,
    expect_increasing_times,
    find_named_file,
    read_sto,
)
from osimlite.mechanics.multibody.functions import ConstantValue, PiecewiseLinear, SmoothFunction
from osimlite.mechanics.multibody.mechanism import FramePlacement, Mechanism
from osimlite.mechanics.multibody.smoothing_spline import natural_splines
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.prescribed import ExternalForce, ExternalLoads
from osimlite.simulation.elements.force_type import DeclaredForce, ForceType
from osimlite.simulation.elements.geometries.load import Load, LoadGeometry
from osimlite.simulation.elements.registry import register_force_type

if TYPE_CHECKING:
    from osimlite.simulation.elements.builder import ElementBuilder

Functions = tuple[SmoothFunction, SmoothFunction, SmoothFunction]
"""Functions of time of three components."""
TABLES = (".mot", ".sto", ENDING)
"""Suffixes of files of forces over time."""
PARTS = ("force", "point", "torque")
"""Parts of a load that columns may give."""


def make_external_load(path: str, name: str, load: Load) -> DeclaredForce:
    """Return the force element of a load.

    Args:
        path: path of the component.
        name: name of the component.
        load: the load.
    """
    return DeclaredForce(ExternalForce, path, name, load, ())


def build_external_loads(
    table: str | Path, applied_to: Mapping[str, Sequence[Sequence[str]]]
) -> ExternalLoads:
    """Return the ExternalLoads for a table without a document.

    Args:
        table: a .mot, .sto or .c3d file, in the axes of ground.
        applied_to: names of the bodies on which the loads act; for each body and load the starts of
            the labels of force, point and moment. The last one or two may be omitted. Without a
            point the force acts at the origin of the body.

    Returns:
        A document with one ExternalForce for each load.

    Raises:
        SettingError: the file has another suffix, or a load has no labels or more than three.
    """
    if Path(table).suffix.lower() not in TABLES:
        raise SettingError(f"'{table}' is not a table of forces ({', '.join(TABLES)})")
    loads = ExternalLoads(name="loads", datafile=str(table))
    for body, several in applied_to.items():
        for number, names in enumerate(several, start=1):
            if not 1 <= len(names) <= len(PARTS) or not names[0]:
                raise SettingError(
                    f"the load on '{body}' is {list(names)}; expected one to three prefixes of column labels: "
                    "that of the force, then that of the point, then that of the moment"
                )
            identifiers: Any = {
                f"{part}_identifier": text for part, text in zip(PARTS, names, strict=False)
            }
            # Names must differ if several loads act on one body.
            name = body.rpartition("/")[2] + (f"_{number}" if len(several) > 1 else "")
            loads.objects.append(ExternalForce(name=name, applied_to_body=body, **identifiers))
    return loads


def read_external_loads(
    mechanism: Mechanism, source: str | Path | ExternalLoads
) -> tuple[DeclaredForce, ...]:
    """Return the loads of a document of ExternalLoads whose `appliesForce` is true.

    The data file is searched in the folder of the document, then in the working directory.

    Args:
        mechanism: mechanism that the loads act on.
        source: the document, or its file.

    Returns:
        The force elements, in the order of the document.

    Raises:
        DocumentError: a file is missing or has other content, the mechanism has no body of a name,
            or an identifier does not match three columns.
    """
    if isinstance(source, ExternalLoads):
        loads = source
        folder = Path()
        file = None
    elif Path(source).suffix.lower() in TABLES:
        # A table alone does not say where forces act.
        message = "this table does not name the bodies on which its forces act"
        next_step = (
            "use a file of ExternalLoads that names this table; inverse dynamics and static "
            "optimization also take the bodies from --applied-to (applied_to=)"
        )
        raise DocumentError(f"{message}: {next_step}", file=str(source))
    else:
        loads = read_object(source, ExternalLoads)
        folder = Path(source).parent
        file = str(source)
    members: list[Any] = [*loads.objects]
    # Members of unknown classes have no `appliesForce`.
    for item in members:
        if not isinstance(item, ExternalForce):
            kind = getattr(item, "class_name", "") or type(item).__name__
            message = f"'{item.name}' is {add_article(kind)}, which OpenSim refuses here; make it an ExternalForce"
            raise DocumentError(message, file=file)
    forces = [force for force in loads.objects if force.appliesForce]
    columns = _Columns(read_loads_table(loads, folder, file), forces)
    return tuple(
        make_external_load(
            f"/componentset/{loads.name}/{force.name}",
            force.name,
            _read_load(mechanism, force, columns, file),
        )
        for force in forces
    )


def read_load_of_model(builder: ElementBuilder, force: ExternalForce) -> Load:
    """Return the load of an ExternalForce in a set of ExternalLoads that is part of the model.

    Args:
        builder: builder of the model's elements.
        force: force component of the model.

    Raises:
        UnsupportedError: the force is not in such a set. OpenSim finds no data for it either.
    """
    loads: Any = builder.tree.parent_of(force)
    if not isinstance(loads, ExternalLoads):
        raise builder.make_unsupported_error(
            force, " outside of ExternalLoads, and therefore without a data file"
        )
    columns = _Columns(read_loads_table(loads, builder.folder, builder.path(loads)), [force])
    return _read_load(builder.mechanism, force, columns, builder.path(loads))


def read_measured_times(source: str | Path) -> Array:
    """Return the times (s) at which some loads were measured.

    Args:
        source: file of a document of ExternalLoads, or a table of forces.

    Raises:
        DocumentError: a file is missing or cannot be read.
    """
    path = Path(source)
    if path.suffix.lower() in TABLES:
        loads, file = ExternalLoads(name="loads", datafile=str(path)), None
    else:
        loads, file = read_object(path, ExternalLoads), str(path)
    return read_loads_table(loads, Path() if file is None else path.parent, file).times


def read_loads_table(loads: ExternalLoads, folder: Path, file: str | None) -> StoTable:
    """Return the data of some loads.

    Args:
        loads: the loads.
        folder: folder in which the data file is searched first.
        file: file of the loads, for messages.

    Raises:
        DocumentError: the loads name no data file, or it cannot be read.
    """
    name = loads.datafile.strip()
    if name in ("", "Unassigned"):
        raise DocumentError("it names no data file; give it a <datafile>", file=file)
    path = str(find_named_file(folder, name))
    return _read_cached_table(path) or _read_table(path)


def _read_table(path: str) -> StoTable:
    """Return a table of forces; a .c3d file is converted to forces, points and torques."""
    return read_c3d_forces(path) if Path(path).suffix.lower() == ENDING else read_sto(path)


_read_cached_table = cache_by_file(4)(_read_table)
"""Cached reader, since each of the loads, and a check of their times, read the same table."""


def _read_load(
    mechanism: Mechanism, force: ExternalForce, columns: _Columns, file: str | None
) -> Load:
    """Return the load of one ExternalForce: its frames, and its numbers as functions of time.

    Args:
        mechanism: mechanism with the frames.
        force: the force.
        columns: columns of the data file.
        file: file of the loads, for errors.

    Raises:
        DocumentError: the force has no identifiers, or a frame or column is missing.
    """
    functions = {
        what: columns.find_functions(identifier, f"the {what}_identifier of '{force.name}'", file)
        for what, identifier in _list_identifiers(force).items()
    }
    # A point alone applies nothing.
    if not functions.keys() & {"force", "torque"}:
        raise DocumentError(
            f"'{force.name}' has no force_identifier and no torque_identifier; add one",
            file=file,
        )
    if "point" in functions and "force" not in functions:
        raise DocumentError(
            f"'{force.name}' has a point_identifier, but no force_identifier; leave out the point_identifier, "
            "or add a force_identifier",
            file=file,
        )

    def find_frame(field: str) -> FramePlacement:
        return _find_frame(mechanism, getattr(force, field), f"the {field} of '{force.name}'", file)

    start = f"{force.applied_to_body}_{force.name}"
    return Load(
        (f"{start}_F", f"{start}_p", f"{start}_T"),
        find_frame("applied_to_body"),
        find_frame("force_expressed_in_body"),
        find_frame("point_expressed_in_body"),
        functions.get("force", ()),
        functions.get("point", ()),
        functions.get("torque", ()),
    )


def _list_identifiers(force: ExternalForce) -> dict[str, str]:
    """Return the starts of the labels of a force's columns.

    Args:
        force: force component of the model.

    Returns:
        Identifiers by part ("force", "point", "torque"), for the parts that the force has.
    """
    identifiers = {what: (getattr(force, f"{what}_identifier") or "").strip() for what in PARTS}
    return {
        what: identifier
        for what, identifier in identifiers.items()
        if identifier not in ("", "Unassigned")
    }


def _find_frame(mechanism: Mechanism, value: Any, what: str, file: str | None) -> FramePlacement:
    """Return the placement of a frame.

    Args:
        mechanism: the mechanism.
        value: path of the frame, name of a body, or component.
        what: name of the property, for messages.
        file: file of the loads, for messages.

    Raises:
        DocumentError: there is no such frame.
    """
    name = value if isinstance(value, str) else value.name
    try:
        # Relative paths of old files begin with "../"; a name without slashes is looked up by name.
        return mechanism.placement(f"/{name.lstrip('./')}" if "/" in name else name)
    except ModelError as error:
        raise DocumentError(f"{what} is '{name}', but {error.message}", file=file) from None


class _Columns:
    """Columns of a table that some forces name, as functions of time."""

    def __init__(self, table: StoTable, forces: Sequence[ExternalForce]) -> None:
        self.table, self._forces = table, forces
        expect_increasing_times(table.times, table.file)
        if not len(table.times):
            raise DocumentError("the table has no rows", file=table.file)

    @cached_property
    def _functions(self) -> dict[int, SmoothFunction]:
        """Functions of all named columns by index; their splines are solved together."""
        # Only columns of some force are fitted: tables of a laboratory hold many more.
        starts = tuple(
            {
                identifier
                for force in self._forces
                for identifier in _list_identifiers(force).values()
            }
        )
        named = [
            index for index, label in enumerate(self.table.columns) if label.startswith(starts)
        ]
        rows = self.table.rows[:, named]
        # `find_functions` reports gaps in the columns that a force uses.
        sound = np.where(np.isfinite(rows), rows, 0.0)
        return dict(zip(named, make_column_functions(self.table.times, sound), strict=True))

    def find_functions(self, identifier: str, what: str, file: str | None) -> Functions:
        """Return the functions of the three columns whose labels begin with an identifier.

        Args:
            identifier: start of the labels.
            what: name of the property, for messages.
            file: file of the loads, for messages.

        Returns:
            Functions of time (s) of the x, y and z component.

        Raises:
            DocumentError: there are not exactly three columns, or one has a gap.
        """
        labels = self.table.columns
        indices = [index for index, label in enumerate(labels) if label.startswith(identifier)]
        if len(indices) != 3:
            raise DocumentError(
                f"{what} is '{identifier}'; {self._explain_mismatch(identifier, indices)}",
                file=file,
            )
        rows = self.table.rows[:, indices]
        bad = np.argwhere(~np.isfinite(rows))
        if len(bad):
            row, column = bad[0]
            raise DocumentError(
                f"'{labels[indices[column]]}' is {rows[row, column]} at {self.table.times[row]:g} s; fill the gap",
                file=self.table.file,
            )
        x, y, z = (self._functions[index] for index in indices)
        return x, y, z

    def _explain_mismatch(self, identifier: str, indices: Sequence[int]) -> str:
        file, labels = self.table.file, self.table.columns
        if indices:
            result = join_words([labels[index] for index in indices])
            return f"exactly three column labels must begin with this text, but in '{file}' these do: {result}"
        # Labels without their last letter are the possible identifiers.
        starts = [label[:-1] for label in labels if label[-1:] in ("x", "X", "1")]
        nearest = find_nearest(identifier, starts) or find_nearest(identifier, labels)
        hint = (
            f"; did you mean '{nearest}'?" if nearest else f"; its columns are {join_words(labels)}"
        )
        return f"no column label of '{file}' begins with this text{hint}"


def make_column_functions(times: Array, columns: Array) -> list[SmoothFunction]:
    """Return columns of a table as functions of time.

    Args:
        times: increasing times (n,), s.
        columns: values (n, k).

    Returns:
        One function for each column.
    """
    if len(times) == 1:
        return [ConstantValue(float(value)) for value in columns[0]]
    # A cubic spline needs four points.
    if len(times) < 4:
        return [
            PiecewiseLinear(tuple(times.tolist()), tuple(column)) for column in columns.T.tolist()
        ]
    return [*natural_splines(times, columns, 2)]


class MeasuredLoad(LoadGeometry):
    """Load of an ExternalForce in a set of ExternalLoads that is part of the model."""

    def read(self, builder: ElementBuilder, force: Any) -> Load:
        """Return the load of a force."""
        return read_load_of_model(builder, force)


register_force_type(ForceType(ExternalForce, MeasuredLoad()))
