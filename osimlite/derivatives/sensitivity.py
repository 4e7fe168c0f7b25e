"""Sensitivities of a simulated motion to numbers of the model and to its start: dS/dt = (df/dx) S + df/dp.

The equation is integrated by Merson's formula over the same steps that `simulate` took, from the
same states: the result is the exact derivative of these steps with their lengths fixed (H. G. Bock,
"Numerical treatment of inverse problems in chemical reaction kinetics", Springer 1981). Where the
laws have a kink (Thelen's muscles have several), a derivative is wrong by the length of a step
although the motion is accurate. Such steps are halved until the derivative is accurate too.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.deprecation import make_deprecated_method
from osimlite.base.records import dataclass
from osimlite.base.text import suggest_path
from osimlite.derivatives.differentiable_model import DifferentiableModel
from osimlite.derivatives.parameters import read_parameter
from osimlite.derivatives.tangents import TangentModel, TangentSteps, tangents
from osimlite.errors import SettingError, SimulationError
from osimlite.io.tables.tabular import Tabular
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model, check_is_model
from osimlite.simulation.engines.protocol import EngineSettings
from osimlite.simulation.initial_state import resolve_initial_values
from osimlite.simulation.options import RUN_OPTIONS
from osimlite.simulation.properties import find_properties
from osimlite.simulation.run import Simulation
from osimlite.simulation.trajectory import Trajectory

OPTIONS = {*RUN_OPTIONS, "folder"} - {"fixed_step", "integrator", "controller", "resume"}
"""Options of `simulate` that keep the motion one of the model's rates, in steps of Merson's method."""
DEFAULT_ACCURACY = 1e-6
"""Accuracy if the caller sets none."""
DERIVATIVE_ERROR_FACTOR = 10.0
"""Error of a derivative in a step, as a multiple of the accuracy, relative to the largest by that number.

A smaller factor does not improve the derivatives, as the motion itself has that error.
"""
RATE_TOLERANCE = 1e-6
"""Largest difference of the rates of tangents and simulation, relative to the largest of a state or 1."""
YIELDING_FACTOR = 1e5
"""Compliance of coordinates that yield to constraints, relative to others."""
RANK_TOLERANCE = 1e-9
"""Relative singular value below which a constraint equation is redundant."""
MIN_STEP_S = 1e-9
"""Length of a step, s, that is not halved further at a kink."""


@dataclass(frozen=True, eq=False)
class Sensitivity(Tabular):
    """Derivatives of a motion by numbers of its model and by its start.

    Attributes:
        trajectory: motion, as `simulate` returns it.
        times: times of the rows (n,), s.
        states: names of the x states as in ``states.sto``: values, speeds, auxiliary states; locked
            coordinates have none.
        numbers: names of the k numbers: paths of parameters, then names of states, which stand for
            their initial values.
        motion: states (n, x) at the times; m, rad, s.
        derivatives: derivative of each state by each number (n, x, k), in units of the state per
            unit of the number.
    """

    trajectory: Trajectory
    times: Array
    states: tuple[str, ...]
    numbers: tuple[str, ...]
    motion: Array
    derivatives: Array

    def get_derivative(self, state: str, number: str) -> Array:
        """Return the derivative of a state by a number along the motion.

        Args:
            state: name of the state.
            number: name of the number.

        Returns:
            Derivative (n,) at the times of the rows.

        Raises:
            SettingError: the state or the number does not exist.
        """
        indices = [
            _find_index(*names)
            for names in (("state", self.states, state), ("number", self.numbers, number))
        ]
        result: Array = self.derivatives[:, indices[0], indices[1]]
        return result

    of = make_deprecated_method("get_derivative")

    @property
    def table(self) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
        """Derivatives as a table.

        Returns:
            The key column ``time`` (s), and columns ``STATE|NUMBER`` (n,), by name.
        """
        columns = {
            f"{state}|{number}": self.get_derivative(state, number)
            for state in self.states
            for number in self.numbers
        }
        return {"time": self.times}, columns


def sensitivity(
    model: Model,
    parameters: Iterable[str] | DifferentiableModel = (),
    to: float = 2.0,
    *,
    states: Iterable[str] = (),
    **options: Any,
) -> Sensitivity:
    """Compute the derivatives of all states along a simulated motion by numbers and initial states.

    The motion is that of :func:`osimlite.simulate` with Merson's steps. Initial states are fixed:
    parts of them that follow from parameters, such as muscles in equilibrium (`equilibrate`), do
    not change with the parameters. Under constraints the initial state changes as little as they
    require.

    Args:
        model: model to simulate and differentiate.
        parameters: paths of numbers of the model, as for :func:`osimlite.tangents`; or its
            tangents, made once for many motions; or its functions (:func:`osimlite.casadi`), for
            their parameters. The values are those in the model now.
        to: end of the motion, s.
        states: names of states (``/jointset/knee/flexion/value``) whose initial values count as
            numbers too.
        options: `accuracy`, `report_interval`, `initial`, `initial_speeds`, `equilibrate`,
            `controls`, `progress` and `folder` of :class:`osimlite.simulation.Options`. The default
            accuracy of 1e-6 gives derivatives of a second of muscles with tendons to 1e-3 of the
            largest, and of smooth motions to 1e-5.

    Returns:
        The motion and its derivatives.

    Raises:
        SettingError: a number or state does not exist, an option is not possible here, or the
            tangents are those of another model.
        UnsupportedError: a force is computed in Python.
        SimulationError: the motion ended early, or a derivative is not finite.
        OsimliteError: see :func:`osimlite.tangents` and :func:`osimlite.simulate`.
    """
    check_is_model(model)
    for name in options:
        if name not in OPTIONS:
            raise SettingError(
                f"'{name}' is not an option of sensitivities, which always use the integrator 'merson'; "
                f"leave it out (possible options: {', '.join(sorted(OPTIONS))})"
            )
    accuracy = options["accuracy"] = options.get("accuracy") or DEFAULT_ACCURACY
    folder = Path(options.get("folder") or ".")
    with Simulation(model, "compiled", folder=folder) as simulation:
        if isinstance(parameters, TangentModel):
            tangent_model = parameters
        else:
            tangent_model = tangents(
                model,
                parameters.parameters
                if isinstance(parameters, DifferentiableModel)
                else parameters,
                folder,
            )
        initial = [_find_index("state", tangent_model.states, name) for name in states]
        for name in tangent_model.parameters:
            _check_not_initial(model, tangent_model, name)
        tangent_model.take(
            np.array([read_parameter(model, name) for name in tangent_model.parameters])
        )
        trajectory = simulation.run(
            to, **{name: options[name] for name in options if name != "folder"}
        )
        _, _, fixed_coordinates = resolve_initial_values(
            simulation.mechanism,
            _select_coordinate_values(simulation, options),
            options.get("initial_speeds") or {},
        )
        motion = _SensitivityRun(tangent_model, simulation, initial, fixed_coordinates)
        rows = motion.compute_rows(trajectory, accuracy)
    names = *tangent_model.parameters, *(tangent_model.states[k] for k in initial)
    return Sensitivity(
        trajectory,
        trajectory.times,
        tangent_model.states,
        names,
        motion.sort_states(trajectory),
        rows,
    )


class _SensitivityRun:
    """Derivatives along the steps of one motion.

    Args:
        tangent_model: tangents of the model with its parameters.
        simulation: simulation of the model with the controls of the motion.
        initial: indices of the states whose initial values count.
        fixed_coordinates: indices in the mechanism of the coordinates with prescribed initial
            values, and of those with prescribed initial speeds.
    """

    def __init__(
        self,
        tangent_model: TangentModel,
        simulation: Simulation,
        initial: Sequence[int],
        fixed_coordinates: Sequence[Sequence[int]],
    ) -> None:
        self._tangent_model = tangent_model
        self._simulation = simulation
        self._initial = initial
        self._prescribed = fixed_coordinates
        engine: Any = simulation.engine
        self._engine = engine
        infos = simulation.mechanism.coordinates
        order = self._engine.order
        coordinate_states = [
            f"{infos[index].path}/{quantity}" for quantity in ("value", "speed") for index in order
        ]
        named_states = [
            *coordinate_states,
            *(variable.path for variable in simulation.state.variables if variable.is_named),
        ]
        if {*named_states} != {
            *tangent_model.states
        } or tangent_model.controls != simulation.forces.controls.names:
            raise SettingError("the tangents are of another model; create them from this one")
        engine_states = [*coordinate_states, *simulation.state.paths]
        self._engine_indices = [engine_states.index(name) for name in tangent_model.states]
        count = len(tangent_model.parameters)
        self._steps = tangent_model.steps(
            engine.current_controls, np.eye(count, count + len(initial))
        )

    def sort_states(self, trajectory: Trajectory) -> Array:
        """Return the states of a motion in the order of the tangents.

        Args:
            trajectory: the motion.

        Returns:
            States (n, x).
        """
        return self._pack_rows(trajectory)[:, self._engine_indices]

    def _pack_rows(self, trajectory: Trajectory) -> Array:
        """Return the states of a motion in the order of the simulation (n, x)."""
        auxiliary = trajectory.auxiliary
        return self._simulation.state.pack_rows(trajectory.values, trajectory.speeds, auxiliary)

    def compute_rows(self, trajectory: Trajectory, accuracy: float) -> Array:
        """Compute the derivatives at the times of a motion.

        Args:
            trajectory: the motion.
            accuracy: accuracy of the motion.

        Returns:
            Derivatives (n, x, k).

        Raises:
            SimulationError: a derivative is not finite.
        """
        start = self._pack_rows(trajectory)[0].tolist()
        row_times = trajectory.times.tolist()
        # The trajectory has rows, but the derivative needs the steps; repeating the motion is
        # cheaper than storing all steps of every simulation.
        times, states, failure = self._simulation.record_every_step(
            0.0, start, row_times[-1], EngineSettings(accuracy=accuracy)
        )
        if failure is not None:
            raise failure
        # Three states suffice to notice tangents of another model.
        for step in (0, len(times) // 2, -1):
            self._check_same_rates(times[step], states[step])
        count = len(self._tangent_model.parameters)
        initial = self._initial
        slopes = np.zeros((len(self._engine_indices), count + len(initial)))
        slopes[initial, range(count, count + len(initial))] = 1.0
        rows = np.array(states)[:, self._engine_indices]
        if self._simulation.constraints:
            self._project_start(rows[0], slopes)
        return integrate_sensitivities(
            self._steps, times, rows, slopes, row_times, accuracy, self._tangent_model.states
        )

    def _project_start(self, x: Array, slopes: Array) -> None:
        """Project the derivatives of the initial state onto the constraints, in place.

        The projection repeats that of the initial state: of free values, yielding coordinates
        change first, then all as little as possible; speeds above 1 change relative to their size.

        Args:
            x: initial state (x,).
            slopes: derivatives of the initial state by parameters and initial values (x, m);
                changed.
        """
        tangent_model = self._tangent_model
        size = len(self._tangent_model.coordinates)
        infos = {info.path: info for info in tangent_model.mechanism.coordinates}
        # As the simulation projects its start: values weigh equally, speeds by their size.
        mobilities = np.ones(size), np.maximum(np.abs(x[size : 2 * size]), 1.0)
        mobilities[0][[infos[path].yielding for path in tangent_model.coordinates]] = (
            YIELDING_FACTOR
        )
        by_numbers = np.eye(len(tangent_model.parameters), slopes.shape[1])
        for level, (fixed_indices, level_mobility, equations) in enumerate(
            zip(
                self._prescribed,
                mobilities,
                tangent_model.compute_constraint_slopes(0.0, x),
                strict=True,
            )
        ):
            level_slice = slice(level * size, (level + 1) * size)
            paths = [tangent_model.mechanism.coordinates[index].path for index in fixed_indices]
            # A scale of 0 keeps coordinates that the caller has set.
            scales = np.where(np.isin(tangent_model.coordinates, paths), 0.0, level_mobility)
            missing = equations @ np.vstack((slopes, by_numbers))
            change = np.linalg.lstsq(
                equations[:, level_slice] * scales, missing, rcond=RANK_TOLERANCE
            )[0]
            slopes[level_slice] -= scales[:, None] * change

    def _check_same_rates(self, t: float, y: Sequence[float]) -> None:
        """Check that the tangents have the same rates as the simulation.

        Args:
            t: time, s.
            y: state in the order of the simulation.

        Raises:
            SettingError: the rates differ.
        """
        expected_rates = np.array(self._engine.compute_derivative(t, y))[self._engine_indices]
        state = np.asarray(y)[self._engine_indices]
        tangent_rates, _ = self._tangent_model.differentiate_along(
            t, state, self._engine.read_controls(), np.zeros((len(state), 0))
        )
        differences = np.abs(tangent_rates - expected_rates)
        if not np.all(
            differences <= RATE_TOLERANCE * max(1.0, np.abs(expected_rates).max(initial=0.0))
        ):
            worst_state = self._tangent_model.states[
                int(np.argmax(np.where(np.isfinite(differences), differences, np.inf)))
            ]
            raise SettingError(
                f"at {t:g} s the derivative of '{worst_state}' differs between tangents and motion; create "
                "the tangents from this model"
            )


def integrate_sensitivities(
    steps: TangentSteps,
    times: Sequence[float],
    states: Array,
    slopes: Array,
    output_times: Sequence[float],
    accuracy: float,
    names: Sequence[str],
) -> Array:
    """Integrate the derivatives of a motion along m directions.

    Args:
        steps: steps of the model with its numbers and directions.
        times: times of the ends of all steps, s.
        states: states at these times (s, x).
        slopes: derivatives of the initial state along the directions (x, m).
        output_times: times of the result (n,), from the start on, s.
        accuracy: accuracy of the motion.
        names: names of the states, for messages.

    Returns:
        Derivatives (n, x, m).

    Raises:
        SimulationError: a derivative is not finite.
    """

    def integrate_step(t0: float, t1: float, y0: Array) -> Array:
        """Take one step, and halve it until the derivatives are accurate.

        Args:
            t0: start of the step, s.
            t1: end of the step, s.
            y0: blocks at the start.

        Returns:
            Blocks at the end.

        Raises:
            SimulationError: a derivative is not finite.
        """
        h = t1 - t0
        y, error = steps.step(t0, t1, y0)
        size = np.abs(y)
        if not np.isfinite(size.sum()):
            worst_state = names[int(np.nonzero(~np.isfinite(steps.slopes(y)).all(axis=1))[0][0])]
            raise SimulationError(
                f"between {t0:g} and {t1:g} s the derivatives of '{worst_state}' are not finite"
            )
        # Weights are those of the integrator; errors are relative to the largest derivative by each number.
        start_size = np.abs(y0)
        weights = 1.0 / np.maximum(1.0, start_size[:, :, :1])
        sizes = (np.maximum(start_size, size) * weights).max(axis=1)
        errors = (np.abs(error) * weights).max(axis=1)
        if h > MIN_STEP_S and (errors > DERIVATIVE_ERROR_FACTOR * accuracy * sizes)[:, 1:].any():
            # The motion keeps its steps; only the derivatives are integrated with half of them.
            middle_time = t0 + h / 2.0
            return integrate_step(middle_time, t1, integrate_step(t0, middle_time, y0))
        return y

    result = np.empty((len(output_times), *slopes.shape))
    row = 1
    result[0] = slopes
    y = steps.blocks(states[0], slopes)
    # Each step starts from the state of the motion, as the steps are those of the motion.
    values = [steps.blocks(state, slopes)[0, :, 0] for state in states]
    for (t, state), (end, _) in pairwise(zip(times, values, strict=True)):
        y[:, :, 0] = state
        while row < len(output_times) and output_times[row] <= end:
            y = integrate_step(t, output_times[row], y)
            t = output_times[row]
            result[row] = steps.slopes(y)
            row = row + 1
        if t < end:
            y = integrate_step(t, end, y)
    return result


def _check_not_initial(model: Model, tangent_model: TangentModel, name: str) -> None:
    """Check that a parameter is not an initial value of a state.

    Args:
        model: model with the parameter.
        tangent_model: tangents of this model.
        name: path of the parameter.

    Raises:
        SettingError: the parameter is one.
    """
    for location in find_properties(model, name):
        property_name = str(location.steps[0])
        state = (
            f"{location.component}/{property_name.removeprefix('default_').removesuffix('_value')}"
        )
        if property_name.startswith("default_") and state in tangent_model.states:
            raise SettingError(
                f"'{name}' is an initial value, which is fixed; pass '{state}' in `states`"
            )


def _select_coordinate_values(
    simulation: Simulation, options: Mapping[str, Any]
) -> dict[str, float]:
    """Return the prescribed initial values of coordinates, without those of auxiliary states."""
    auxiliary = simulation.state.paths
    return {
        name: value
        for name, value in (options.get("initial") or {}).items()
        if name not in auxiliary
    }


def _find_index(noun: str, names: Sequence[str], name: str) -> int:
    """Return the index of a name.

    Args:
        noun: noun for the named thing, such as "output", for messages.
        names: all names.
        name: the name.

    Raises:
        SettingError: the name does not exist.
    """
    if name not in names:
        raise SettingError(f"there is no {noun} '{name}'{suggest_path(name, names)}")
    return names.index(name)
