"""Trajectories as Moco writes them: times, states, controls, multipliers, derivatives, slacks, parameters."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from osimlite.base.files import make_folder, open_atomically
from osimlite.base.records import dataclass, field
from osimlite.base.text import format_count
from osimlite.errors import DocumentError
from osimlite.io.tables.storage import StoTable, format_adapter_table, read_sto
from osimlite.mechanics.multibody.spatial import Array
from osimlite.optimal.layout import VariableLayout

COLUMN_KINDS = (
    "states",
    "controls",
    "input_controls",
    "multipliers",
    "derivatives",
    "slacks",
    "parameters",
)
"""Kinds of columns that the header counts, in the order of the columns."""


@dataclass(frozen=True, eq=False)
class MocoTrajectory:
    """Trajectory of all variables; OpenSim's class of this name reads its files.

    Attributes:
        times: times (n,), s.
        columns: values (n,) of each variable by name; m, rad, s, N.
        names: names of the columns by kind, such as ``states`` and ``controls``.
        parameters: values of parameters by name.
        header: further entries of the file's header, such as ``objective``.
    """

    times: Array
    columns: dict[str, Array]
    names: dict[str, tuple[str, ...]]
    parameters: dict[str, float] = field(default_factory=dict)
    header: dict[str, str] = field(default_factory=dict)

    @classmethod
    def from_variables(
        cls, layout: VariableLayout, w: Array, header: dict[str, str] | None = None
    ) -> MocoTrajectory:
        """Return the trajectory of the variables of a nonlinear program.

        Variables at some points only (velocity corrections, projection slacks) are interpolated at
        all times, as in Moco.

        Args:
            layout: layout of the variables.
            w: variables (n,).
            header: further entries of the file's header; None for none.
        """
        times = w[0] + layout.problem.grid.fractions * (w[1] - w[0])
        columns: dict[str, Array] = {}
        # Moco's files do not contain the states before projection.
        for kind in (kind for kind in COLUMN_KINDS if kind in layout.names):
            for number, name in enumerate(layout.names[kind]):
                indices = layout.indices[kind][:, number]
                values = w[indices[indices >= 0]]
                if len(values) < len(times):
                    values = np.interp(times, np.linspace(times[0], times[-1], len(values)), values)
                columns[name] = values
        # Moco reads the columns of a guess by their order, not by their names.
        rank = {
            name.removesuffix("/value"): k
            for k, name in enumerate(layout.problem.functions.system_states)
        }
        names = {
            kind: tuple(
                sorted(
                    values,
                    key=lambda name: rank.get(re.sub("/(value|accel)$", "", name), len(rank)),
                )
            )
            for kind, values in layout.names.items()
            if kind in COLUMN_KINDS
        }
        parameters = dict(
            zip(layout.problem.parameters, w[2 : layout.shared].tolist(), strict=True)
        )
        return cls(times, columns, names, parameters, header or {})

    @classmethod
    def read(cls, path: str | Path) -> MocoTrajectory:
        """Read a file of Moco, or any table of states and controls over time.

        Args:
            path: path of the file.

        Returns:
            The trajectory.

        Raises:
            OsimliteError: the file cannot be read.
            DocumentError: the file has no times, or its header counts other columns.
        """
        table = read_sto(path)
        if not len(table.times):
            raise DocumentError("the file has no times", file=str(path))
        count_texts = {f"num_{kind}": table.header.get(f"num_{kind}", "0") for kind in COLUMN_KINDS}
        for name, count_text in count_texts.items():
            if not count_text.isdecimal():
                raise DocumentError(
                    f"the header says {name}={count_text}, which is not a count", file=str(path)
                )
        counts = [*map(int, count_texts.values())]
        # A table that no Moco wrote has no counts; its columns are states for the guess, whatever
        # they are.
        if not any(counts):
            counts[0] = len(table.columns)
        if sum(counts) != len(table.columns):
            message = (
                f"the header counts {format_count(sum(counts), 'column')} besides the time, "
                f"but the file has {len(table.columns)}"
            )
            raise DocumentError(message, file=str(path))
        names = dict[str, tuple[str, ...]]()
        first_column = 0
        for kind, count in zip(COLUMN_KINDS, counts, strict=True):
            names[kind] = table.columns[first_column : first_column + count]
            first_column += count
        column_by_name = {name: table.rows[:, index] for index, name in enumerate(table.columns)}
        parameters = {name: float(column_by_name.pop(name)[0]) for name in names.pop("parameters")}
        return cls(table.times, column_by_name, names, parameters, table.header)

    def table(self, kind: str = "") -> StoTable:
        """Return the table of the columns of one kind, or of all columns and the parameters.

        Args:
            kind: one of `COLUMN_KINDS`; empty for all columns.
        """
        column_kinds: Iterable[str] = [kind] if kind else COLUMN_KINDS[:-1]
        names = [name for column_kind in column_kinds for name in self.names.get(column_kind, ())]
        rows = (
            np.column_stack([self.columns[name] for name in names])
            if names
            else np.zeros((len(self.times), 0))
        )
        header = {}
        if not kind:
            # OpenSim writes the values of parameters into the first row only.
            parameter_rows = np.full((len(self.times), len(self.parameters)), np.nan)
            parameter_rows[0] = [*self.parameters.values()]
            rows = np.hstack([rows, parameter_rows])
            all_names = self.names | {"parameters": tuple(self.parameters)}
            names += self.parameters
            header_entries = self.header | {
                f"num_{column_kind}": str(len(all_names.get(column_kind, ())))
                for column_kind in COLUMN_KINDS
            }
            header = {"inDegrees": "no", **dict(sorted(header_entries.items()))}
        return StoTable("", self.times, tuple(names), rows, header=header)

    def write(self, path: str | Path) -> None:
        """Write a file that OpenSim's MocoTrajectory reads.

        Args:
            path: path of the file, whose folder is made if it does not exist.

        Raises:
            OsimliteError: the file cannot be written.
        """
        make_folder(Path(path).parent)
        with open_atomically(path) as stream:
            stream.writelines(line.encode() for line in format_adapter_table(self.table()))
