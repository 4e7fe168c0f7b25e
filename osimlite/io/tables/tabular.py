"""Results as tables of other libraries."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

from osimlite.base.require import require


class Tabular(ABC):
    """Results that are a table."""

    @property
    @abstractmethod
    def table(self) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
        """What tells the rows apart, and the columns, each (n,) by its name."""

    def to_frame(self) -> Any:
        """The `table` as a pandas DataFrame, with what tells the rows apart as its index.

        Raises:
            MissingDependency: pandas is not installed.
        """
        pandas = require("pandas", extra="frame", purpose="a data frame")
        rows, columns = self.table
        return pandas.DataFrame(columns, index=pandas.DataFrame(rows).set_index(list(rows)).index)

    def to_arrow(self) -> Any:
        """The `table` as a pyarrow Table, which Polars, DuckDB and Parquet take as it is.

        Raises:
            MissingDependency: pyarrow is not installed.
        """
        rows, columns = self.table
        return require("pyarrow", extra="frame", purpose="an Arrow table").table(
            {**rows, **columns}
        )

    def to_xarray(self) -> Any:
        """The `table` as an xarray Dataset over what tells the rows apart.

        Raises:
            MissingDependency: xarray or pandas is not installed.
        """
        require("xarray", extra="frame", purpose="a data set of xarray")
        return self.to_frame().to_xarray()
