"""Conversion of results to tables of pandas, Arrow and xarray."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

from osimlite.base.require import require


class Tabular(ABC):
    """Result that can be converted to tables of other libraries."""

    @property
    @abstractmethod
    def table(self) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
        """The table of the result.

        Returns:
            Index columns, which identify the rows, and value columns; each (n,) by name.
        """

    def to_frame(self) -> Any:
        """Return the `table` as a pandas DataFrame with its index columns as index.

        Raises:
            MissingDependency: pandas is not installed.
        """
        pandas = require("pandas", extra="frame", purpose="a data frame")
        rows, columns = self.table
        return pandas.DataFrame(columns, index=pandas.DataFrame(rows).set_index(list(rows)).index)

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
