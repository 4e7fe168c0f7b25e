"""Conversion of results to tables of pandas, Arrow and xarray."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from itertools import islice
from typing import Any

from osimlite.base.require import require
from osimlite.base.text import format_count

TEXT_ROWS = 8
"""Columns that the text of a result lists."""
HTML_ROWS = 30
"""Columns that a notebook lists."""
MAX_NAME_LENGTH = 40
"""Letters of a name in the text of a result."""


class Tabular(ABC):
    """Result that can be converted to tables of other libraries.

    Its text is a short table: the heading, then smallest and largest value of the first columns.
    """

    @property
    def heading(self) -> str:
        """Class and size of the result, in one line."""
        rows, columns = self.table
        count = len(next(iter(rows.values()), ()))
        words = f"{format_count(count, 'row')}, {format_count(len(columns), 'column')}"
        return f"{type(self).__name__}: {words}"

    @property
    def units(self) -> Mapping[str, str]:
        """Units of the columns of `table` by name, as far as they are known."""
        return {}

    @property
    def _text_columns(self) -> Mapping[str, Any]:
        """Columns that the text lists."""
        return self.table[1]

    def __repr__(self) -> str:
        columns = self._text_columns
        units = self.units
        rows = [
            (name if len(name) <= MAX_NAME_LENGTH else f"...{name[3 - MAX_NAME_LENGTH :]}", *cells)
            for name, *cells in _describe_columns(columns, units, TEXT_ROWS)
        ]
        lines = [self.heading]
        if rows:
            rows = [("", "smallest", "largest", ""), *rows]
            widths = [max(len(row[index]) for row in rows) for index in range(4)]
            lines += [
                f"{name:{widths[0]}}  {low:>{widths[1]}}  {high:>{widths[2]}}  {unit}".rstrip()
                for name, low, high, unit in rows
            ]
        if len(columns) > TEXT_ROWS:
            lines.append(f"... and {format_count(len(columns) - TEXT_ROWS, 'more column')}")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        # Only notebooks need it.
        from html import escape

        return f"<div>{escape(self.heading)}</div>{self.format_html_table()}"

    def format_html_table(self) -> str:
        """Return smallest and largest values of the first columns as an HTML table, without the heading."""
        # Only notebooks need it.
        from html import escape

        columns = self._text_columns
        header = "".join(f"<th>{word}</th>" for word in ("", "smallest", "largest", "unit"))
        rows = "".join(
            "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>"
            for row in _describe_columns(columns, self.units, HTML_ROWS)
        )
        hidden_count = len(columns) - HTML_ROWS
        footer = (
            f"<div>... and {format_count(hidden_count, 'more column')}</div>"
            if hidden_count > 0
            else ""
        )
        table = f"<table><thead><tr>{header}</tr></thead><tbody>{rows}</tbody></table>"
        return f"{table}{footer}"

    @property
    @abstractmethod
    def table(self) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
        """The table of the result.

        Returns:
            Index columns, which identify the rows, and value columns; each (n,) by name.
        """

    def to_frame(self) -> Any:
        """Return the `table` as a pandas DataFrame with its index columns as index.

        ``frame.attrs["units"]`` has the `units` of the columns by name.

        Raises:
            MissingDependency: pandas is not installed.
        """
        return self._make_frame(self.table[1], self.units)

    def _make_frame(self, columns: Mapping[str, Any], units: Mapping[str, str]) -> Any:
        """Return a pandas DataFrame of columns with their units."""
        pandas = require("pandas", extra="frame", purpose="a data frame")
        rows = self.table[0]
        frame = pandas.DataFrame(columns, index=pandas.DataFrame(rows).set_index(list(rows)).index)
        if units:
            frame.attrs["units"] = dict(units)
        return frame

    def to_arrow(self) -> Any:
        """Return the `table` as a pyarrow Table, which Polars, DuckDB and Parquet read directly.

        Raises:
            MissingDependency: pyarrow is not installed.
        """
        rows, columns = self.table
        return require("pyarrow", extra="frame", purpose="an Arrow table").table(
            {**rows, **columns}
        )

    def to_xarray(self) -> Any:
        """Return the `table` as an xarray Dataset over its index columns.

        Raises:
            MissingDependency: xarray or pandas is not installed.
        """
        require("xarray", extra="frame", purpose="a data set of xarray")
        return self.to_frame().to_xarray()


def _describe_columns(
    columns: Mapping[str, Any], units: Mapping[str, str], count: int
) -> list[tuple[str, str, str, str]]:
    """Return name, smallest and largest value, and unit of the first columns."""
    # Imported here: most results are printed without numbers to compare.
    import numpy as np

    result = []
    for name, column in islice(columns.items(), count):
        values = np.asarray(column)
        # Columns of text have no range.
        finite = values[np.isfinite(values)] if values.dtype.kind in "iuf" else values[:0]
        low, high = (f"{finite.min():.4g}", f"{finite.max():.4g}") if finite.size else ("-", "-")
        result.append((name, low, high, units.get(name, "")))
    return result
