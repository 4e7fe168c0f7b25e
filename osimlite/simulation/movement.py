"""Values of coordinates over time, wherever they come from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from osimlite.base.require import require
from osimlite.io.tables.tabular import Tabular
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array


class Movement(Tabular):
    """A motion of a mechanism."""

    mechanism: Mechanism  # what moves
    times: Array  # (t,), s
    values: Array  # of all n coordinates (t, n), in the mechanism's order, rad and m

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates, in the mechanism's order."""
        return self.mechanism.coordinate_names

    @property
    def table(self) -> tuple[Mapping[str, Array], Mapping[str, Array]]:
        """The coordinates over ``time``, rad and m."""
        return {"time": self.times}, dict(zip(self.coordinates, self.values.T, strict=True))

    @property
    def in_degrees(self) -> Array:
        """The values (t, n) with rotational coordinates in degrees, as OpenSim's files have them."""
        turning = [info.motion_type == "rotational" for info in self.mechanism.coordinates]
        return np.where(turning, np.rad2deg(self.values), self.values)

    def to_xarray(self) -> Any:
        """An xarray Dataset: ``value`` over ``time`` and ``coordinate``, rad and m.

        Raises:
            MissingDependency: xarray is not installed.
        """
        xarray = require("xarray", extra="frame", purpose="a data set of xarray")
        over = {"time": self.times, "coordinate": list(self.coordinates)}
        return xarray.Dataset(
            {"value": (("time", "coordinate"), self.values)}, over, {"model": self.mechanism.name}
        )
