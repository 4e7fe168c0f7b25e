"""Scenarios of SCONE: model, controller, measures of a walk, and parameters to optimize."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.records import dataclass
from osimlite.base.text import format_count, suggest_or_list
from osimlite.errors import SettingError, SimulationError
from osimlite.io.document.reader import read
from osimlite.io.tables.storage import StoTable, read_sto
from osimlite.mechanics.kernels.walks import ORDER, PROGRESS
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.simulation.options import DEFAULT_ACCURACY, IntegrationOptions
from osimlite.studies.reflexes.controllers import CONTROLLERS, Reflexes
from osimlite.studies.reflexes.measures import MEASURES, Criteria, Measure
from osimlite.studies.reflexes.parameters import Parameter, Parameters, read_par
from osimlite.studies.reflexes.settings import (
    SettingNode,
    find_file,
    make_node,
    matches_pattern,
    read_settings,
)
from osimlite.studies.reflexes.walkers import Walkers

OPTIMIZERS = "CmaOptimizer", "CmaPoolOptimizer"
"""Parts of SCONE around a SimulationObjective; both are read as settings of one CMA-ES search."""
INTEGRATORS = {
    "SemiExplicitEuler2": "euler2",
    "RungeKuttaMerson": "merson",
    "Rosenbrock": "rosenbrock",
}
"""Our integrators by SCONE's names; `Rosenbrock` is ours, SCONE has no such name."""
DEFAULT_POPULATION = 16
"""Candidates per generation of a scenario that states none."""
DEFAULT_GENERATIONS = 1000
"""Generations of a scenario that states none."""
IGNORED_SEARCH_SETTINGS = (
    "output_root",
    "min_progress",
    "window_size",
    "max_threads",
)
"""Settings of a search that change no result, or only the moment at which SCONE ends the search."""
MAX_LIFT_M = 10.0
"""Farthest distance (m) by which the start height is moved to find the required load."""
LOAD_TOLERANCE = 0.1
"""Relative error of the load at the start that is accepted."""
MAX_BISECTIONS = 100
"""Most bisections of the start height; more than double precision can resolve."""
LIFT_STEP_M = 0.1
"""Step (m) by which the start height is moved until it brackets the required load."""
MAX_POPULATION = 10_000
"""Most candidates of a generation: each one has a state and a record of its own."""
MAX_SEED = 2**32 - 2
"""Largest seed that numpy takes (2**32 - 1), less 1 because the search adds 1."""
MAX_CONTROL_STEPS = 2_000_000
"""Most control steps of a walk, which bounds the memory: each one is recorded."""
MIN_CONTROL_STEP_S = 1e-4
"""Shortest control step (s), which bounds the number of records."""
STEPS_PER_CALL = 100
"""Control steps per call of the kernels; between calls Python handles Ctrl-C."""


@dataclass(frozen=True, eq=False)
class WalkResult:
    """Result of simulating some candidates of a scenario.

    Attributes:
        results: score of each candidate (w,), smaller is better; a measure to be maximized has its
            sign changed.
        times: time at which each walk ended (w,) (s).
        terms: weighted contribution of each measure to the results (w,), by the name of the
            measure.
        report: further quantities of the measures (w,), for example the speed (m/s), by name.
        states: states of the first candidate at each control step.
        excitations: excitations of the muscles of the first candidate.
        loads: ground reaction force on each leg of the first candidate over the body weight.
    """

    results: Array
    times: Array
    terms: dict[str, Array]
    report: dict[str, Array]
    states: StoTable
    excitations: StoTable
    loads: StoTable


class Scenario:
    """Model, controller, measures and search settings of a file of SCONE.

    Args:
        given: file of SCONE or YAML, or Python data of the same content, whose files are relative
            to the working directory.
        model: model to use instead of the `model_file` of the scenario.

    Attributes:
        model: model that walks.
        controller: class name and node of the controller.
        measure: class name and node of the measure.
        initial: best value, mean and standard deviation of each parameter from the `init` files, by
            name.
        duration: longest duration of a walk (s).
        step: duration of a control step (s).
        population: candidates per generation of a search.
        generations: number of generations of a search.
        seed: seed of the search.

    Raises:
        DocumentError: the scenario has something that is not supported; the error has its name and
            line.
    """

    def __init__(self, given: str | Path | Mapping[str, Any], model: Model | None = None) -> None:
        if isinstance(given, Mapping):
            self.folder, root_node = Path(), make_node(given)
        else:
            self.folder = Path(given).parent
            root_node = read_settings(given)
        selected_optimizer = next(iter(root_node.select_all(*OPTIMIZERS)), None)
        self.optimizer = root_node if selected_optimizer is None else selected_optimizer[1]
        self.population = DEFAULT_POPULATION
        self.generations = DEFAULT_GENERATIONS
        self.seed = 0
        objective = self.optimizer.get("SimulationObjective")
        if objective is None:
            raise self.optimizer.error("a scenario needs a SimulationObjective in a CmaOptimizer")
        self._objective = objective
        self.duration = objective.number("max_duration", 1e3)
        if not self.duration > 0.0:
            raise objective.error(f"max_duration is {self.duration:g} s; set a positive duration")
        settings = objective.get("ModelOpenSim4")
        if settings is None:
            other_model = next(
                (name for name, _ in objective.parts if name.startswith("Model")), "no model"
            )
            raise objective.error(
                f"osimlite supports only ModelOpenSim4 as a model, found {other_model}"
            )
        self.settings: SettingNode = settings
        if model is None:
            model = read(find_file(settings.text("model_file"), self.folder))
        settings.get("model_file")
        self.model = model
        self.step = read_control_step(settings)
        if self.duration < self.step:
            raise objective.error(
                f"a walk of {self.duration:g} s is shorter than a control step of {self.step:g} s"
            )
        self.initial = read_initial_parameters(self.optimizer, self.folder)
        if selected_optimizer is not None:
            self.population = self.optimizer.count("lambda", DEFAULT_POPULATION, 1, MAX_POPULATION)
            self.generations = self.optimizer.count(
                "max_generations", DEFAULT_GENERATIONS, 0, 10**9
            )
            self.seed = self.optimizer.count("random_seed", 0, 0, MAX_SEED)
            for key in IGNORED_SEARCH_SETTINGS:
                self.optimizer.get(key)
            self.optimizer.refuse_unread_parts(f"a {selected_optimizer[0]}")
        self._walkers: dict[int, Walkers] = {}
        self._read_settings()

    def _read_settings(self) -> None:
        """Read controller, measure and integrator, and refuse settings that are not supported."""
        objective, settings = self._objective, self.settings
        # These are read later, only if a walk needs them, and must not count as unknown.
        for key in (
            "initial_load_dof",
            "state_init_file",
            "integration_method",
            "integration_accuracy",
            "initial_load",
            "initial_state_offset",
            "initial_state_offset_exclude",
            "initial_state_offset_include",
            "initial_state_offset_symmetric",
            "leg_upper_body",
            "leg_lower_body",
            "leg_contact_force",
            "initial_equilibration_activation",
            "max_integration_step_size",
        ):
            settings.get(key)
        settings.refuse_unread_parts("a ModelOpenSim4")
        self.controller = objective.require_one("controller", CONTROLLERS)
        self.measure = objective.require_one("measure", MEASURES)
        objective.refuse_unread_parts("a SimulationObjective", tuple(MEASURES))
        method = settings.text("integration_method", "SemiExplicitEuler2")
        if method not in INTEGRATORS:
            raise settings.error(
                f"there is no integrator '{method}'{suggest_or_list(method, INTEGRATORS)}"
            )
        self._integrator = INTEGRATORS[method]

    # ---------------------------------------------------------------------------------------------- candidates
    def best(self) -> dict[str, float]:
        """Return the best values of the `init` files.

        Returns:
            Value per name of a parameter.
        """
        return {name: best_value for name, (best_value, _, _) in self.initial.items()}

    def parameters(self) -> list[Parameter]:
        """Return all parameters to optimize, with the initial means and standard deviations.

        The `init` files of the scenario override the distributions that are written at the
        parameters.
        """
        requested = Parameters({})
        Candidates(self, requested, self.step)
        result = []
        for parameter in requested.requested.values():
            _, mean, std = self.initial.get(
                parameter.name, (parameter.mean, parameter.mean, parameter.std)
            )
            result.append(parameter._replace(mean=mean, std=std))
        return result

    def walk(
        self,
        values: Mapping[str, Array | float],
        count: int = 1,
        *,
        duration: float | None = None,
    ) -> WalkResult:
        """Simulate candidates until they fall or the duration ends.

        Args:
            values: value of each parameter by name: one for all candidates, or an array (w,) with
                one for each. Others have their means.
            count: number of candidates w.
            duration: longest duration (s); by default that of the scenario.

        Returns:
            Score and end time of each candidate, contributions of the measures to the scores, and
            the motion of the first candidate.

        Raises:
            SettingError: the duration is shorter than a control step or has too many, a parameter
                is unknown, or has another number of values than there are candidates.
        """
        if duration is not None and not duration >= self.step:
            raise SettingError(
                f"a walk of {duration:g} s is shorter than a control step of {self.step:g} s"
            )
        length = self.duration if duration is None else duration
        # The record of the first candidate is allocated for the complete walk.
        if not length <= MAX_CONTROL_STEPS * self.step:
            message = f"a walk of {length:g} s has more than {MAX_CONTROL_STEPS} control steps of {self.step:g} s"
            raise SettingError(message)
        parameters = Parameters(values, count)
        for name, value in values.items():
            if np.shape(value) not in ((), (count,)):
                raise SettingError(
                    f"'{name}' has {format_count(np.size(value), 'value')} for {format_count(count, 'candidate')}"
                )
        candidates = Candidates(self, parameters, length)
        for name in values:
            if name not in parameters.requested and name not in self.initial:
                raise SettingError(
                    f"the scenario has no parameter '{name}'{suggest_or_list(name, parameters.requested)}"
                )
        return candidates.walk()

    def get_walkers(self, count: int) -> Walkers:
        """Return the copies of the model for a number of candidates.

        They are cached, because making them takes longer than a walk.
        """
        if count not in self._walkers:
            node = self.settings
            self._walkers[count] = Walkers(
                self.model.copy_deep(),
                count,
                self.step,
                IntegrationOptions(
                    accuracy=node.number("integration_accuracy", DEFAULT_ACCURACY),
                    integrator=self._integrator,
                    step_bounds=(0.0, node.number("max_integration_step_size", np.inf)),
                ),
                read_leg_names(node),
            )
        return self._walkers[count]

    def close(self) -> None:
        """Release the compiled engines of all copies."""
        for walkers in self._walkers.values():
            walkers.close()
        self._walkers.clear()


class Candidates:
    """Candidates of a scenario with their reflexes and measures, at the start of a walk.

    Args:
        scenario: scenario to simulate.
        parameters: values of the parameters of each candidate.
        duration: longest duration of the walk (s).
    """

    def __init__(self, scenario: Scenario, parameters: Parameters, duration: float) -> None:
        self.scenario = scenario
        self.parameters = parameters
        self.duration = duration
        self.walkers = walkers = scenario.get_walkers(parameters.count)
        self._set_initial_states()
        controller_type, controller = scenario.controller
        reflexes = Reflexes(controller, controller_type, walkers, parameters)
        self._steps = round(duration / walkers.step)
        name, measure_node = scenario.measure
        criteria = Criteria(self._steps)
        self.measure: Measure = MEASURES[name](measure_node, walkers, criteria)
        walkers.set_reflexes_and_criteria(*reflexes.pack(), *criteria.pack(), criteria.size)
        node = scenario.settings
        load = node.number("initial_load", 0.2)
        height = walkers.offsets.get(
            node.text("initial_load_dof", "/jointset/ground_pelvis/pelvis_ty/value")
        )
        # A model without this vertical coordinate, or a load of 0, starts at the height of its
        # file.
        if load > 0.0 and height is not None:
            for candidate in range(walkers.count):
                _settle_on_ground(walkers, candidate, height, load)

    def _set_initial_states(self) -> None:
        """Set the initial states: the model's default, then a file, then offsets.

        Offsets may be parameters.
        """
        walkers = self.walkers
        node = self.scenario.settings
        scenario = self.scenario
        states = walkers.copies.states
        walkers.copies.set_states(slice(None), np.tile(walkers.copies.start, (walkers.count, 1)))
        file = node.text("state_init_file", "")
        if file:
            self._read_state_file(find_file(file, scenario.folder))
        offset = node.get("initial_state_offset")
        if offset is not None:
            included = node.text("initial_state_offset_include", "*")
            excluded = (
                # Offsets of muscle states would be overwritten by the equilibrium.
                node.text("initial_state_offset_exclude", "") + ";*/activation;*/fiber_length"
            )
            symmetric = node.flag("initial_state_offset_symmetric", False)
            for path, index in walkers.offsets.items():
                if matches_pattern(path, included) and not matches_pattern(path, excluded):
                    # With the side removed, both legs share one parameter.
                    name = path.replace("_l/", "/").replace("_r/", "/") if symmetric else path
                    states[:, index] += self.parameters.parse_number(offset, f"{name}.offset")

    def _read_state_file(self, path: Path) -> None:
        """Set initial states from a storage file (.sto) or a SCONE file.

        A SCONE file has the blocks `values` and `velocities`.
        """
        walkers = self.walkers
        if path.suffix.lower() == ".sto":
            table = read_sto(path)
            for label in table.columns:
                if label in walkers.offsets and len(table.times):
                    walkers.copies.states[:, walkers.offsets[label]] = table[label][0]
            return
        root_node = read_settings(path)
        for block, ending in (("values", "value"), ("velocities", "speed")):
            block_node = root_node.get(block)
            for name, node in block_node.parts if block_node is not None else ():
                offset = next(
                    (
                        number
                        for state_name, number in walkers.offsets.items()
                        if state_name.endswith(f"/{name}/{ending}")
                    ),
                    None,
                )
                if offset is None:
                    raise node.error(
                        f"the model has no coordinate '{name}'{suggest_or_list(name, walkers.coordinates)}"
                    )
                try:
                    walkers.copies.states[:, offset] = float(node.value)
                except ValueError:
                    raise node.error(f"'{name}' must be a number, not '{node.value}'") from None

    def walk(self) -> WalkResult:
        """Simulate the candidates; the order of equilibrium and reflexes is that of SCONE.

        Returns:
            Score and end time of each candidate, contributions of the measures to the scores, and
            the motion of the first candidate.
        """
        walkers = self.walkers
        small = self.scenario.settings.number("initial_equilibration_activation", 0.05)
        # SCONE computes the first excitations from muscles in equilibrium at a small activation, and
        # then brings the muscles into equilibrium with these excitations as activations.
        walkers.equilibrate_muscles(np.full(walkers.excitations.shape, small))
        walkers.advance(ORDER.BEGIN)
        walkers.equilibrate_muscles(walkers.excitations)
        walkers.advance(ORDER.START)
        rows = []
        active = list(range(walkers.count))
        for first_step in range(0, self._steps, STEPS_PER_CALL):
            rows.append(walkers.advance(min(STEPS_PER_CALL, self._steps - first_step), active))
            # Candidates that have fallen are not simulated any further.
            active = np.flatnonzero(walkers.progress[:, PROGRESS.GOING]).tolist()
            if not active:
                break
        # The kernels record the start of each step; the end of the last one is added here.
        rows.append(
            np.concatenate(
                [walkers.copies.states[0], walkers.excitations[0], walkers.get_leg_loads()[0]]
            )[None]
        )
        times = walkers.step * walkers.progress[:, PROGRESS.STEPS].astype(np.float64)
        results = self.measure.add_weighted(times, self.duration) * (
            1.0 if self.measure.minimize else -1.0
        )
        return WalkResult(
            results,
            times,
            self.measure.terms,
            self.measure.report,
            *self._make_tables(np.concatenate(rows)),
        )

    def _make_tables(self, rows: Array) -> tuple[StoTable, StoTable, StoTable]:
        """Return states, excitations and loads of the first candidate as tables."""
        walkers = self.walkers
        times = walkers.step * np.arange(len(rows), dtype=np.float64)
        legs = tuple(f"leg{leg.side}.load" for leg in walkers.legs)
        size = walkers.copies.states.shape[1]
        states, excitations, loads = np.split(rows, (size, size + len(walkers.names)), axis=1)
        return (
            StoTable(
                "states", times, tuple(walkers.offsets), states[:, [*walkers.offsets.values()]]
            ),
            StoTable("excitations", times, tuple(walkers.names), excitations),
            StoTable("loads", times, legs, loads),
        )


def read_initial_parameters(
    optimizer: SettingNode, folder: Path
) -> dict[str, tuple[float, float, float]]:
    """Read the .par files with which a search starts.

    Args:
        optimizer: node with any number of `init` parts; later ones override earlier ones.
        folder: folder of the scenario.

    Returns:
        Best value, mean (the best value with `use_best_as_mean`) and standard deviation times
        `std_factor` of each parameter, by name.
    """
    result: dict[str, tuple[float, float, float]] = {}
    for _, init in optimizer.select_all("init"):
        file_parameters = read_par(find_file(init.text("file"), folder))
        factor = init.number("std_factor", 1.0)
        uses_best = init.flag("use_best_as_mean", False)
        result |= {
            name: (v[0], v[0] if uses_best else v[1], factor * v[2])
            for name, v in file_parameters.items()
        }
        init.refuse_unread_parts("an init")
    return result


def read_control_step(node: SettingNode) -> float:
    """Return the duration of a control step (s)."""
    step = node.number("fixed_control_step_size", 0.005)
    if not MIN_CONTROL_STEP_S <= step < np.inf:
        raise node.error(
            f"'fixed_control_step_size' is {MIN_CONTROL_STEP_S:g} s or more, not {step:g} s"
        )
    return step


def read_leg_names(node: SettingNode) -> dict[str, str]:
    """Return the names of the bodies and contact forces of legs.

    Returns:
        Names without their side, as the `legs` of
        :class:`osimlite.studies.reflexes.walkers.SensedModel`.
    """
    return {
        "upper": node.text("leg_upper_body", "femur"),
        "lower": node.text("leg_lower_body", ""),
        "contact": node.text("leg_contact_force", "foot"),
    }


def _settle_on_ground(walkers: Walkers, candidate: int, height: int, load: float) -> None:
    """Move a walker to the height at which the ground carries a part of its weight, as SCONE does.

    Args:
        walkers: candidates.
        candidate: index of the candidate.
        height: offset of the vertical coordinate in its state.
        load: required ground reaction force over the weight.

    Raises:
        SimulationError: no height within `MAX_LIFT_M` carries this load.
    """
    state = walkers.copies.states[candidate]
    start = float(state[height])

    def compute_load(value: float) -> float:
        state[height] = value
        walkers.advance(ORDER.FEEL, (candidate,))
        return float(walkers.get_leg_loads()[candidate].sum())

    # The load falls with height; bracket the root, then bisect.
    upper = start
    while compute_load(upper) > load and upper - start < MAX_LIFT_M:
        upper += LIFT_STEP_M
    lower = upper - LIFT_STEP_M
    while compute_load(lower) <= load and lower - start > -MAX_LIFT_M:
        lower -= LIFT_STEP_M
    for _ in range(MAX_BISECTIONS):
        middle_height = 0.5 * (upper + lower)
        carried_load = compute_load(middle_height)
        if abs(carried_load - load) / load <= LOAD_TOLERANCE:
            return
        upper, lower = (upper, middle_height) if carried_load > load else (middle_height, lower)
    raise SimulationError(
        f"no initial height was found at which the ground carries {load:g} times the body weight"
    )
