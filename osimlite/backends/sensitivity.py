"""How a simulated motion depends on numbers of the model and on where it starts: dS/dt = (df/dx) S + df/dp.

The equation is integrated by Merson's formula over the very steps that `simulate` took, from the states that it found:
what comes out is the exact derivative of these steps, their lengths held (H. G. Bock, "Numerical treatment of inverse
problems in chemical reaction kinetics", Springer 1981). Where the laws have a bend (Thelen's muscles have several), a
derivative is off by the length of a step although the motion is not: such steps are halved until it is accurate too.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.backends.functions import CasadiModel
from osimlite.backends.parameters import number_of
from osimlite.errors import SettingError, SimulationError, UnsupportedError
from osimlite.multibody.spatial import Array
from osimlite.records import dataclass
from osimlite.schema.model import Model, expect_model
from osimlite.simulation.engines.protocol import Settings
from osimlite.simulation.options import PER_RUN
from osimlite.simulation.run import Simulation
from osimlite.simulation.tabular import Tabular
from osimlite.simulation.trajectory import Trajectory
from osimlite.sweep.properties import places
from osimlite.text import did_you_mean

CHOICES = {*PER_RUN, "folder"} - {"fixed_step", "integrator", "controller", "resume"}
"""Options of `simulate` that leave the motion one of the functions of CasADi, in steps of Merson's method."""
ACCURACY = 1e-6
"""That is taken where none is chosen."""
LOOSER = 10.0
"""So many times the accuracy is what the error of a derivative may be in a step, over the largest by that number: less
makes them no better, for the motion is not."""
SAME = 1e-6
"""What derivatives of the functions may be off from those of machine code, over the largest of a state or 1."""
SHORTEST = 1e-9
"""Part of a step, s, to which a bend of the equations is narrowed down."""


@dataclass(frozen=True, eq=False)
class Sensitivity(Tabular):
    """The derivatives of a motion by numbers of its model and by its start.

    Attributes:
        trajectory: the motion, as `simulate` gives it.
        times: of its rows (n,), s.
        states: names of the x states as in ``states.sto``: values, speeds, auxiliary states; locked coordinates are
            none.
        numbers: what the derivatives are by (k,): paths of parameters, then names of states, which stand for their
            values at the start.
        motion: the states (n, x) at the times; m, rad, s.
        derivatives: of each state by each number (n, x, k), in units of the state over those of the number.
    """

    trajectory: Trajectory
    times: Array
    states: tuple[str, ...]
    numbers: tuple[str, ...]
    motion: Array
    derivatives: Array

    def of(self, state: str, number: str) -> Array:
        """The derivative (n,) of a state by a number.

        Raises:
            SettingError: there is no such state, or no such number.
        """
        at = [_place(*names) for names in (("state", self.states, state), ("number", self.numbers, number))]
        result: Array = self.derivatives[:, at[0], at[1]]
        return result

    @property
    def table(self) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
        """Columns ``STATE|NUMBER`` (n,) over ``time`` (s)."""
        columns = {f"{state}|{number}": self.of(state, number) for state in self.states for number in self.numbers}
        return {"time": self.times}, columns


def sensitivity(
    model: Model,
    parameters: Iterable[str] | CasadiModel = (),
    to: float = 2.0,
    *,
    states: Iterable[str] = (),
    **choices: Any,
) -> Sensitivity:
    """The derivatives of all states along a simulated motion by numbers of the model and by states at its start.

    The motion is that of :func:`osimlite.simulate` by Merson's steps. Its start is held: what of it follows from
    parameters, as where muscles are in equilibrium (`equilibrate`), counts as given.

    Args:
        model: what moves.
        parameters: numbers of the model, by paths as :func:`osimlite.casadi` takes them; or its functions, for theirs,
            so that they are made once for many motions. Their values are those in the model now.
        to: how long, s.
        states: names of states (``/jointset/knee/flexion/value``) that the derivatives are by, too, at the start.
        choices: `accuracy`, `report_interval`, `initial`, `initial_speeds`, `equilibrate`, `controls`, `progress` and
            `folder` of :class:`osimlite.simulation.Options`. The accuracy is 1e-6 if left out, with which the
            derivatives of a second of muscles with tendons are good to 1e-3 of the largest, of smooth motions to 1e-5;
            take less for more.

    Raises:
        SettingError: there is no such number or state, or an option that does not go with this; the functions are
            those of another model.
        UnsupportedError: constraints bind the motion, a path runs around a surface, or a part of the model has no
            formula.
        SimulationError: the motion ended, or a derivative of it is no finite number.

    Other errors are those of :func:`osimlite.casadi` and :func:`osimlite.simulate`.
    """
    expect_model(model)
    for name in choices:
        if name not in CHOICES:
            raise SettingError(
                f"'{name}' does not go with sensitivities, which follow Merson's steps of the model as it is; "
                f"leave it out ({', '.join(sorted(CHOICES))} can be chosen)"
            )
    accuracy = choices["accuracy"] = choices.get("accuracy") or ACCURACY
    folder = Path(choices.get("folder") or ".")
    functions = parameters if isinstance(parameters, CasadiModel) else CasadiModel(model, tuple(parameters), folder)
    if functions.searched:
        raise UnsupportedError(
            f"'{functions.searched[0]}' runs around a surface, where derivatives jump; put a polynomial in its place "
            "first (osimlite.modify(model, paths='polynomial'))"
        )
    initial = [_place("state", functions.states, name) for name in states]
    for name in functions.parameters:
        _require_held(model, functions, name)
    p = np.array([number_of(model, name) for name in functions.parameters])
    with Simulation(model, "compiled", folder=folder) as simulation:
        if simulation.constraints:
            raise UnsupportedError(
                f"'{simulation.constraints[0]}' constrains the motion, which is projected after each step; take it out "
                "of the model, lock coordinates, or take `residual` and `constraints` of osimlite.casadi"
            )
        trajectory = simulation.run(to, **{name: choices[name] for name in choices if name != "folder"})
        motion = _Followed(functions, simulation, p, initial)
        rows = motion.rows(trajectory, accuracy)
    names = *functions.parameters, *(functions.states[k] for k in initial)
    return Sensitivity(trajectory, trajectory.times, functions.states, names, motion.states(trajectory), rows)


class _Followed:
    """The derivatives along the steps of a motion.

    Args:
        functions: of the model.
        simulation: of it, with the controls of the motion.
        p: the parameters (p,).
        initial: places of the states of which the start counts.
    """

    def __init__(self, functions: CasadiModel, simulation: Simulation, p: Array, initial: Sequence[int]) -> None:
        self._functions, self._simulation, self._p, self._initial = functions, simulation, p, initial
        self._engine: Any = simulation.engine
        infos, order = simulation.mechanism.coordinates, self._engine.order
        moving = [f"{infos[place].path}/{what}" for what in ("value", "speed") for place in order]
        known = [*moving, *(variable.path for variable in simulation.state.variables if variable.is_named)]
        if {*known} != {*functions.states} or functions.controls != simulation.forces.controls.names:
            raise SettingError("the functions are of another model; make them of this one")
        own = [*moving, *simulation.state.paths]
        self._places = [own.index(name) for name in functions.states]
        self._step = _step(functions, len(p) + len(initial))

    def states(self, trajectory: Trajectory) -> Array:
        """The motion (n, x), in the order of the functions."""
        return self._rows(trajectory)[:, self._places]

    def _rows(self, trajectory: Trajectory) -> Array:
        auxiliary = trajectory.auxiliary
        return self._simulation.state.rows(trajectory.values, trajectory.speeds, auxiliary)

    def rows(self, trajectory: Trajectory, accuracy: float) -> Array:
        """The derivatives (n, x, k) at the times of the motion."""
        # Parts of steps share their ends.
        self._driven = dict[float, list[float]]()
        self._start = start = self._rows(trajectory)[0].tolist()
        wanted = trajectory.times.tolist()
        times, states, ended = self._simulation.every_step(0.0, start, wanted[-1], Settings(accuracy))
        if ended is not None:
            raise ended
        count = len(self._p)
        y = np.zeros((len(self._places), 1 + count + len(self._initial)))
        y[self._initial, range(1 + count, y.shape[1])] = 1.0
        result, row = np.zeros((len(wanted), len(y), y.shape[1] - 1)), 1
        result[0] = y[:, 1:]
        for place in (0, len(times) // 2, -1):
            self._require_same(times[place], states[place])
        for (t, state), (end, _) in pairwise(zip(times, states, strict=True)):
            y[:, 0] = np.asarray(state)[self._places]
            while row < len(wanted) and wanted[row] <= end:
                y, t = self._stepped(t, wanted[row], y, accuracy), wanted[row]
                result[row], row = y[:, 1:], row + 1
            if t < end:
                y = self._stepped(t, end, y, accuracy)
        return result

    def _stepped(self, t0: float, t1: float, y0: Array, accuracy: float) -> Array:
        """State and derivatives at the end of a step, in as many parts as the accuracy of the derivatives needs."""
        h = t1 - t0
        controls = [self._controls(t) for t in (t0, t0 + h / 3.0, t0 + h / 2.0, t1)]
        y, error = (part.full() for part in self._step(t0, h, y0, np.array(controls).T, self._p))
        if not np.isfinite(y).all():
            worst = self._functions.states[int(np.nonzero(~np.isfinite(y))[0][0])]
            raise SimulationError(f"between {t0:g} and {t1:g} s the derivatives of '{worst}' are no finite numbers")
        # As the integrator weighs states; of each number, what counts is its largest derivative.
        weights = 1.0 / np.maximum(1.0, np.abs(y0[:, :1]))
        sizes = (np.maximum(np.abs(y0), np.abs(y)) * weights)[:, 1:].max(axis=0)
        if h > SHORTEST and np.any((np.abs(error) * weights)[:, 1:] > LOOSER * accuracy * sizes):
            middle = t0 + h / 2.0
            return self._stepped(middle, t1, self._stepped(t0, middle, y0, accuracy), accuracy)
        return y

    def _controls(self, t: float) -> list[float]:
        """What drives the actuators at a time."""
        if not self._simulation.forces.controls.names:
            return []
        if t not in self._driven:
            self._engine.derivative(t, self._start)
            self._driven[t] = self._engine.controls()
        return self._driven[t]

    def _require_same(self, t: float, y: Sequence[float]) -> None:
        """SettingError where the functions say another derivative of the state than machine code."""
        wanted = np.array(self._engine.derivative(t, y))[self._places]
        found = self._functions.dynamics(t, np.asarray(y)[self._places], self._engine.controls(), self._p)
        off = np.abs(found.full()[:, 0] - wanted)
        if not np.all(off <= SAME * max(1.0, np.abs(wanted).max(initial=0.0))):
            worst = self._functions.states[int(np.argmax(np.where(np.isfinite(off), off, np.inf)))]
            raise SettingError(
                f"at {t:g} s the functions say another derivative of '{worst}' than the motion has; make them of this "
                "very model"
            )


def _step(functions: CasadiModel, count: int) -> Any:
    """``step(t, h, y, u, p) -> y, error``: one of Merson's steps, with its exact derivative.

    y (x, 1 + count) are the state and its derivatives; the controls (u, 4) are those at the start, after a third, at
    the middle and at the end.
    """
    from osimlite.backends.symbols import casadi

    sizes = {"t": 1, "x": len(functions.states), "u": len(functions.controls), "p": len(functions.parameters)}
    given = [casadi.SX.sym(name, size) for name, size in sizes.items()]
    xdot = functions.dynamics(*given)
    slopes = [casadi.jacobian(xdot, given[place]) for place in (1, 3)]
    linear = casadi.Function("linear", given, [xdot, *slopes])
    t, h, p = (casadi.MX.sym(name, size) for name, size in (("t", 1), ("h", 1), ("p", sizes["p"])))
    y, u = casadi.MX.sym("y", sizes["x"], 1 + count), casadi.MX.sym("u", sizes["u"], 4)
    own = casadi.DM(np.eye(sizes["p"], count))

    def f(part: float, y: Any, control: int) -> Any:
        xdot, a, b = linear(t + part * h, y[:, 0], u[:, control], p)
        return casadi.horzcat(xdot, a @ y[:, 1:] + b @ own)

    f0 = f(0.0, y, 0)
    fa = f(1.0 / 3.0, y + h / 3.0 * f0, 1)
    fb = f(1.0 / 3.0, y + h / 6.0 * (f0 + fa), 1)
    fc = f(0.5, y + h / 8.0 * (f0 + 3.0 * fb), 2)
    last = y + h / 2.0 * (f0 - 3.0 * fb + 4.0 * fc)
    end = y + h / 6.0 * (f0 + 4.0 * fc + f(1.0, last, 3))
    # What Merson takes for the error.
    return casadi.Function("step", [t, h, y, u, p], [end, 0.2 * (end - last)])


def _require_held(model: Model, functions: CasadiModel, name: str) -> None:
    """SettingError for a number that says where a state starts."""
    for place in places(model, name):
        what = str(place.steps[0])
        state = f"{place.component}/{what.removeprefix('default_').removesuffix('_value')}"
        if what.startswith("default_") and state in functions.states:
            raise SettingError(f"'{name}' is where a state starts, which is held; take '{state}' among the states")


def _place(what: str, names: Sequence[str], name: str) -> int:
    if name not in names:
        raise SettingError(f"there is no {what} '{name}'{did_you_mean(name, names)}")
    return names.index(name)
