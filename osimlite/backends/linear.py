"""A model near one of its states: xdot - f = A (x - x0) + B (u - u0)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.backends.functions import CasadiModel
from osimlite.errors import SettingError
from osimlite.multibody.spatial import Array
from osimlite.records import dataclass
from osimlite.schema.model import Model, expect_model
from osimlite.text import did_you_mean

Given = Mapping[str, float] | Sequence[float] | None


@dataclass(frozen=True, eq=False)
class Linearization:
    """The derivative of the state of a model near a state.

    Attributes:
        states: names of the entries of x, as in ``states.sto``; values, speeds, auxiliary states.
        controls: names of the entries of u: paths of the actuators.
        time: s.
        x: the state (x,).
        u: the controls (u,).
        xdot: derivative of the state there (x,).
        A: its derivative by the state (x, x), exact.
        B: that by the controls (x, u), exact.
    """

    states: tuple[str, ...]
    controls: tuple[str, ...]
    time: float
    x: Array
    u: Array
    xdot: Array
    A: Array
    B: Array


def linearize(
    model: Model | CasadiModel,
    state: Given = None,
    controls: Given = None,
    *,
    time: float = 0.0,
    folder: str | Path | None = None,
) -> Linearization:
    """The exact derivatives of the motion of a model by its state and by the controls of its actuators.

    Controllers of the model are left aside: what they do is no part of A. Under constraints, accelerations are those
    that fulfil them.

    Args:
        model: that moves, or its functions (:func:`osimlite.casadi`), which are made once then.
        state: numbers by the names of states, the others as the model has them, or all (x,) in their order.
        controls: numbers by the paths of actuators, the others 0, or all (u,).
        time: s.
        folder: where the model's file is, for the files that it names; the folder that the program runs in if None.

    Raises:
        SettingError: there is no such state or control.

    Other errors are those of :func:`osimlite.casadi`.
    """
    if not isinstance(model, CasadiModel):
        expect_model(model)
        model = CasadiModel(model, (), Path(folder or "."))
    x = _filled("state", model.states, model.x, state)
    u = _filled("control", model.controls, model.u, controls)
    xdot, a, b = (np.array(part.full()) for part in model.linear(time, x, u, model.p))
    return Linearization(model.states, model.controls, time, x, u, xdot[:, 0], a, b)


def _filled(what: str, names: Sequence[str], default: Array, given: Any) -> Array:
    result = default.copy()
    if isinstance(given, Mapping):
        for name, value in given.items():
            if name not in names:
                raise SettingError(f"the model has no {what} '{name}'{did_you_mean(name, names)}")
            result[names.index(name)] = value
    elif given is not None:
        if len(given) != len(names):
            raise SettingError(f"the model has {len(names)} {what}s, not {len(given)}")
        result[:] = given
    return result
