"""Outputs of components that are functions of time, as inputs of controllers."""

from __future__ import annotations

from typing import Any

from osimlite.base.records import dataclass
from osimlite.base.text import did_you_mean
from osimlite.errors import ModelError
from osimlite.io.tables.storage import beside
from osimlite.mechanics.multibody.functions import Function, PiecewiseLinear
from osimlite.schema.reporters import SignalGenerator, TableSource__double_
from osimlite.simulation.elements.control_tables import read_controls
from osimlite.simulation.elements.gather import ElementBuilder


@dataclass(frozen=True)
class TableColumn(PiecewiseLinear):
    """Straight lines between the rows of a table, outside of which there is nothing."""

    source: str = ""  # path of the component that has the table


def signal(builder: ElementBuilder, controller: Any, text: str) -> Function | None:
    """The output that a controller's input names as `path|output:channel`; None if it is no function of time.

    Raises:
        ModelError: there is no such output.
    """
    path, _, output = text.partition("(")[0].partition("|")
    source = builder.tree.walk(path, builder.path(controller), "Component").target
    if source is None:
        raise ModelError(
            f"an input of '{builder.path(controller)}' names '{text}', which the model does not have; "
            "run 'osimlite validate'"
        )
    name, _, channel = output.partition(":")
    if isinstance(source, SignalGenerator) and name == "signal":
        return builder.function(source, source.function, "function")
    if isinstance(source, TableSource__double_) and name == "column":
        table = read_controls(beside(builder.folder, source.filename))
        if channel not in table.columns:
            raise ModelError(
                f"'{builder.path(source)}' has no column '{channel}'{did_you_mean(channel, table.columns)}",
                file=table.file,
            )
        if len(table.times) < 2:
            raise ModelError("the table has one row; give it at least two", file=table.file)
        return TableColumn(
            tuple(table.times.tolist()), tuple(table[channel].tolist()), builder.path(source)
        )
    return None
