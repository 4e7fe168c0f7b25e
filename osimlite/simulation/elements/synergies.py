"""Controllers by synergies, and their inputs: outputs of components that are functions of time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from osimlite.base.text import format_count, suggest_name
from osimlite.errors import ModelError, UnsupportedError
from osimlite.io.tables.storage import find_named_file
from osimlite.mechanics.multibody.functions import ScaledFunction, SmoothFunction
from osimlite.schema.controller_types import SynergyController
from osimlite.schema.reporters import SignalGenerator, TableSource__double_
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.control_tables import TableColumn, read_controls
from osimlite.simulation.elements.controls import Drive, find_actuators
from osimlite.simulation.elements.registry import register_controller


def read_signal(builder: ElementBuilder, controller: Any, text: str) -> SmoothFunction | None:
    """Return the output that an input of a controller names, as a function of time.

    Args:
        builder: builder of the elements.
        controller: controller with the input.
        text: the text of the input, `path|output:channel`.

    Returns:
        The function; None if the output is not a known function of time.

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
        return builder.read_function(source, source.function, "function")
    if isinstance(source, TableSource__double_) and name == "column":
        table = read_controls(find_named_file(builder.folder, source.filename))
        if channel not in table.columns:
            raise ModelError(
                f"'{builder.path(source)}' has no column '{channel}'{suggest_name(channel, table.columns)}",
                file=table.file,
            )
        if len(table.times) < 2:
            raise ModelError("the table has one row; give it at least two", file=table.file)
        return TableColumn(
            tuple(table.times.tolist()), tuple(table[channel].tolist()), builder.path(source)
        )
    return None


@register_controller(SynergyController)
def drive_by_synergies(builder: ElementBuilder, controller: SynergyController) -> Iterator[Drive]:
    """Yield each signal times the weight of each control; nothing if there are no signals.

    Raises:
        ModelError: the numbers of signals and vectors, or of weights and controls, differ.
    """
    path = builder.path(controller)
    vectors = controller.synergy_vectors
    counts = [
        (item, getattr(type(item), "control_count", 1))
        for item in find_actuators(builder, controller)
    ]
    targets = [(item, number) for item, count in counts for number in range(count)]
    for vector in vectors:
        if len(vector.synergy_weights) != len(targets):
            raise ModelError(
                f"the synergy vector '{vector.name}' of '{path}' has "
                f"{format_count(len(vector.synergy_weights), 'weight')} for {format_count(len(targets), 'control')}; "
                "give it one for each"
            )
    words = controller.input_controls
    if words and len(words) != len(vectors):
        raise ModelError(
            f"'{path}' has {format_count(len(words), 'input')} for {format_count(len(vectors), 'synergy vector')}; "
            "give it one for each"
        )
    for vector, word in zip(vectors, words, strict=False):
        function = read_signal(builder, controller, word)
        for (actuator, number), weight in zip(targets, vector.synergy_weights, strict=True):
            if function is None:
                refused: UnsupportedError = builder.make_unsupported_error(
                    actuator,
                    f" driven by '{path}', whose input '{word}' is not a known function of time",
                )
                yield Drive(actuator, refused)
            else:
                yield Drive(actuator, ScaledFunction(weight, function), number)
