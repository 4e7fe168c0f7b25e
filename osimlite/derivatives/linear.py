"""Linearization of the motion of a model about a state.

With the rates f and the outputs y0 at (x0, u0): xdot - f = A (x - x0) + B (u - u0) and
y - y0 = C (x - x0) + D (u - u0).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.records import dataclass
from osimlite.base.text import format_count, suggest_name, suggest_path
from osimlite.derivatives.functions import CasadiModel
from osimlite.derivatives.tangents import TangentModel, tangents
from osimlite.errors import SettingError, SimulationError
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model

NamedValues = Mapping[str, float] | Sequence[float] | None
"""Values by name, or all values in their order; None for the defaults."""


@dataclass(frozen=True, eq=False)
class Linearization:
    """Linearization of a model about a state.

    Attributes:
        states: names of the entries of x, as in ``states.sto``: values, speeds, auxiliary states.
        controls: names of the entries of u: paths of the actuators.
        time: time, s.
        x: state (x,).
        u: controls (u,).
        xdot: derivative of the state (x,).
        A: derivative of xdot by the state (x, x), exact.
        B: derivative of xdot by the controls (x, u), exact.
        outputs: names of the entries of y, as ``GROUP:ENTRY``.
        y: outputs (y,).
        C: derivative of the outputs by the state (y, x), exact.
        D: derivative of the outputs by the controls (y, u), exact.
    """

    states: tuple[str, ...]
    controls: tuple[str, ...]
    time: float
    x: Array
    u: Array
    xdot: Array
    A: Array
    B: Array
    outputs: tuple[str, ...]
    y: Array
    C: Array
    D: Array

    def __repr__(self) -> str:
        counts = [
            format_count(len(self.states), "state"),
            format_count(len(self.controls), "control"),
            format_count(len(self.outputs), "output"),
        ]
        return f"Linearization at {self.time:g} s: {', '.join(counts)}"


def linearize(
    model: Model | TangentModel | CasadiModel,
    state: NamedValues = None,
    controls: NamedValues = None,
    *,
    outputs: Sequence[str] = (),
    time: float = 0.0,
    folder: str | Path | None = None,
) -> Linearization:
    """Linearize the motion of a model with respect to its state and the controls of its actuators.

    Controllers of the model are ignored: A does not contain their feedback. Under constraints the
    accelerations fulfil them.

    Args:
        model: model; or its tangents (:func:`osimlite.tangents`) or functions
            (:func:`osimlite.casadi`), made once for many states.
        state: values by the names of states, the others as in the model; or all (x,) in their
            order; None for the state of the model.
        controls: values by the paths of actuators, the others 0; or all (u,); None for zeros.
        outputs: outputs in the order of y: groups of `TangentModel.output_names` (``mass_center``),
            or entries of groups (``mass_center:y``, ``forces:/forceset/soleus_r|tension``).
        time: time, s.
        folder: folder of the model's file, for the files that it names; the current folder if None.

    Returns:
        The matrices with the names of their rows and columns.

    Raises:
        SettingError: a state, control or output does not exist.
        SimulationError: a coordinate moves no mass, or a derivative is not finite.
        OsimliteError: see :func:`osimlite.tangents`.
    """
    if isinstance(model, CasadiModel):
        model = model.in_tangents
    elif not isinstance(model, TangentModel):
        model = tangents(model, (), folder)
    x = _fill_vector("state", model.states, model.x, state)
    u = _fill_vector("control", model.controls, model.u, controls)
    xdot, a, b = model.linear(time, x, u)
    if len(xdot) and np.isnan(xdot).all():
        raise SimulationError(
            "the model has no accelerations in this state; simulate from it to see the reason"
        )
    output_indices = _find_outputs(model.output_names if outputs else {}, outputs)
    if not (np.isfinite(xdot).all() and np.isfinite(a).all() and np.isfinite(b).all()):
        raise SimulationError(_describe_invalid_entry(model.states, model.controls, xdot, a, b))
    y, c, d = (
        model.compute_outputs(time, x, u, output_indices)
        if outputs
        # Matrices without rows still have their columns, so that products with states and controls
        # work.
        else (np.zeros((0, size)) for size in (1, len(x), len(u)))
    )
    if not all(np.isfinite(matrix).all() for matrix in (y, c, d)):
        raise SimulationError(
            "an output of the model or its derivative is not finite in this state"
        )
    names = tuple(f"{group}:{model.output_names[group][k]}" for group, k in output_indices)
    return Linearization(
        model.states, model.controls, time, x, u, xdot, a, b, names, y.ravel(), c, d
    )


def _describe_invalid_entry(
    states: Sequence[str], controls: Sequence[str], xdot: Array, a: Array, b: Array
) -> str:
    """Return the message for the first derivative that is NaN or infinite.

    Args:
        states: names of the states.
        controls: names of the controls.
        xdot: rates (x,).
        a: derivatives by the state (x, x).
        b: derivatives by the controls (x, u).
    """
    columns = [("", xdot.reshape(-1, 1), [""]), (" by ", a, states), (" by ", b, controls)]
    for preposition, matrix, names in columns:
        invalid_entries = np.argwhere(~np.isfinite(matrix))
        if len(invalid_entries):
            row, column = invalid_entries[0]
            entry_description = f"the rate of '{states[row]}'" + (
                f"{preposition}'{names[column]}'" if preposition else ""
            )
            return (
                f"{entry_description} is {matrix[row, column]:g}; look for a number in the model "
                "that is far too large or small"
            )
    return "a derivative is not finite"


def _find_outputs(
    output_names: Mapping[str, Sequence[str]], names: Sequence[str]
) -> list[tuple[str, int]]:
    """Return group and index of each named output.

    Args:
        output_names: names of the entries by group.
        names: names of groups, or entries as ``GROUP:ENTRY``.

    Raises:
        SettingError: an output does not exist.
    """
    groups = {
        group: [(group, k) for k in range(len(labels))] for group, labels in output_names.items()
    }
    entries = {
        f"{group}:{label}": [(group, k)]
        for group, labels in output_names.items()
        for k, label in enumerate(labels)
    }
    outputs_by_name = {**groups, **entries}
    result = list[tuple[str, int]]()
    for name in names:
        if name not in outputs_by_name:
            raise SettingError(
                f"the model has no output '{name}'{suggest_name(name, outputs_by_name)}"
            )
        result += outputs_by_name[name]
    return result


def _fill_vector(noun: str, names: Sequence[str], default: Array, user_values: Any) -> Array:
    """Return the default values with some of them replaced.

    Args:
        noun: "state" or "control", for messages.
        names: names of the entries.
        default: default values.
        user_values: values by name, or all values in their order; None for the defaults.

    Raises:
        SettingError: a name does not exist, or there are more or fewer values.
    """
    result = default.copy()
    if isinstance(user_values, Mapping):
        for name, value in user_values.items():
            if name not in names:
                raise SettingError(f"the model has no {noun} '{name}'{suggest_path(name, names)}")
            result[names.index(name)] = value
    elif user_values is not None:
        if len(user_values) != len(names):
            raise SettingError(
                f"expected {format_count(len(names), 'value')}, one for each {noun} of the model; got {len(user_values)}"
            )
        result[:] = user_values
    return result
