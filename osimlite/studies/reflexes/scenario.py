"""A scenario of SCONE: a model, its controller, how it is judged, and what is looked for."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.records import dataclass
from osimlite.base.text import join_words, suggest_or_list
from osimlite.errors import SettingError, SimulationError
from osimlite.io.document.reader import read
from osimlite.io.tables.storage import StoTable, read_sto
from osimlite.mechanics.kernels.walks import BEGIN, FEEL, GOING, START, STEPS
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.simulation.options import DEFAULT_ACCURACY, IntegrationOptions
from osimlite.studies.reflexes.controllers import CONTROLLERS, Reflexes
from osimlite.studies.reflexes.measures import MEASURES, Criteria, Measure
from osimlite.studies.reflexes.parameters import Parameter, Parameters, read_par
from osimlite.studies.reflexes.settings import (
    Node,
    find_file,
    matches_pattern,
    read_settings,
    settings_of,
)
from osimlite.studies.reflexes.walkers import Walkers

OPTIMIZERS = "CmaOptimizer", "CmaPoolOptimizer"
INTEGRATORS = {
    "SemiExplicitEuler2": "euler2",
    "RungeKuttaMerson": "merson",
    "Rosenbrock": "rosenbrock",
}
"""By the names of SCONE; the last is ours."""
POPULATION, GENERATIONS = 16, 1000
"""Of a search whose scenario says nothing."""
LEFT_ASIDE = (
    "output_root",
    "min_progress",
    "window_size",
    "max_threads",
)
"""Settings of a search that change no result, or only when SCONE ends it."""
HIGH, CLOSE, TRIES = 10.0, 0.1, 100
"""How far a walker is lifted or lowered at most to carry its weight (m), how well it has to carry it, and tries."""
LIFT = 0.1
"""M, by which it is lifted at a time."""
MAX_POPULATION = 10_000
"""Candidates of a generation: each has a state and a record of its own."""
MAX_SEED = 2**32 - 2
"""The largest seed that numpy takes, less the one that CMA-ES adds."""
MAX_STEPS = 2_000_000
"""Control steps of a walk: each is recorded."""
SHORTEST = 1e-4
"""S, of a control step: each is recorded."""
AT_ONCE = 100
"""Control steps of a call; between them Ctrl-C is heard."""


@dataclass(frozen=True, eq=False)
class Walked:
    """What became of some candidates.

    Attributes:
        results: what is to become small (w,); of a measure that is to be large, the negative of it.
        times: when each ended, s (w,).
        terms: parts of the results, by the names of measures.
        report: what measures say besides.
        states: of the first candidate over time.
        excitations: of its muscles.
        loads: forces on its legs, over the weight.
    """

    results: Array
    times: Array
    terms: dict[str, Array]
    report: dict[str, Array]
    states: StoTable
    excitations: StoTable
    loads: StoTable


class Scenario:
    """What walks, by which reflexes, and how it is judged.

    Args:
        given: file of a scenario, SCONE's or YAML; or the same as data of Python, whose files are
            in the folder that the program runs in.
        model: that walks, in the place of a `model_file`.

    Attributes:
        model: that walks. controller: name and part of what excites the muscles. measure: name and
            part of what judges. begun: parameters that a file of the scenario begins with: best,
            mean and standard deviation. duration: of a walk, s. population, generations, seed: of a
            search.

    Raises:
        DocumentError: it has something that is not done here; its name and line are told.
    """

    def __init__(self, given: str | Path | Mapping[str, Any], model: Model | None = None) -> None:
        if isinstance(given, Mapping):
            self.folder, top = Path(), settings_of(given)
        else:
            self.folder, top = Path(given).parent, read_settings(given)
        found = next(iter(top.all_of(*OPTIMIZERS)), None)
        self.optimizer = top if found is None else found[1]
        self.population, self.generations, self.seed = POPULATION, GENERATIONS, 0
        objective = self.optimizer.get("SimulationObjective")
        if objective is None:
            raise self.optimizer.error("a scenario needs a SimulationObjective in a CmaOptimizer")
        self._objective = objective
        self.duration = objective.number("max_duration", 1e3)
        if not self.duration > 0.0:
            raise objective.error(
                f"a walk of {self.duration:g} s is none; max_duration is to be positive"
            )
        settings = objective.get("ModelOpenSim4")
        if settings is None:
            other = next(
                (name for name, _ in objective.parts if name.startswith("Model")), "no model"
            )
            raise objective.error(
                f"of models only ModelOpenSim4 is done here, and this has {other}"
            )
        self.settings: Node = settings
        if model is None:
            model = read(find_file(settings.text("model_file"), self.folder))
        settings.get("model_file")
        self.model = model
        self.step = control_step(settings)
        if self.duration < self.step:
            raise objective.error(
                f"a walk of {self.duration:g} s is shorter than a control step of {self.step:g} s"
            )
        self.begun = read_initial_parameters(self.optimizer, self.folder)
        if found is not None:
            self.population = self.optimizer.count("lambda", POPULATION, 1, MAX_POPULATION)
            self.generations = self.optimizer.count("max_generations", GENERATIONS, 0, 10**9)
            self.seed = self.optimizer.count("random_seed", 0, 0, MAX_SEED)
            for key in LEFT_ASIDE:
                self.optimizer.get(key)
            self.optimizer.expect_all_asked(f"a {found[0]}")
        self._walkers: dict[int, Walkers] = {}
        self._refuse()

    def _refuse(self) -> None:
        objective, settings = self._objective, self.settings
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
        settings.expect_all_asked("a ModelOpenSim4")
        controller, measure = objective.one_of(*CONTROLLERS), objective.one_of(*MEASURES)
        if controller is None:
            other = next(
                (name for name, _ in objective.parts if name.endswith("Controller")), "none"
            )
            raise objective.error(
                f"of controllers {join_words(list(CONTROLLERS))} are done here, and this has {other}"
            )
        if measure is None:
            raise objective.error(f"a measure is needed: {join_words(list(MEASURES))}")
        self.controller, self.measure = controller, measure
        objective.expect_all_asked("a SimulationObjective", tuple(MEASURES))
        method = settings.text("integration_method", "SemiExplicitEuler2")
        if method not in INTEGRATORS:
            raise settings.error(
                f"there is no integrator '{method}'{suggest_or_list(method, INTEGRATORS)}"
            )
        self._integrator = INTEGRATORS[method]

    # ---------------------------------------------------------------------------------------------- candidates
    def best(self) -> dict[str, float]:
        """The best values that the scenario begins with."""
        return {name: best for name, (best, _, _) in self.begun.items()}

    def parameters(self) -> list[Parameter]:
        """All that are looked for, with the means and widths that the scenario begins with."""
        found = Parameters({})
        Candidates(self, found, self.step)
        result = []
        for each in found.found.values():
            _, mean, std = self.begun.get(each.name, (each.mean, each.mean, each.std))
            result.append(each._replace(mean=mean, std=std))
        return result

    def walk(
        self,
        values: Mapping[str, Array | float],
        count: int = 1,
        *,
        duration: float | None = None,
    ) -> Walked:
        """Have candidates walk until they fall, or to the end.

        Args:
            values: of the parameters, of each candidate (w,) or one for all.
            count: of candidates.
            duration: s; that of the scenario if None.

        Raises:
            SettingError: the duration is shorter than a control step.
        """
        if duration is not None and not duration >= self.step:
            raise SettingError(
                f"a walk of {duration:g} s is shorter than a control step of {self.step:g} s"
            )
        length = self.duration if duration is None else duration
        if not length <= MAX_STEPS * self.step:
            message = (
                f"a walk of {length:g} s has more than {MAX_STEPS} control steps of {self.step:g} s"
            )
            raise SettingError(message)
        parameters = Parameters(values, count)
        for name, value in values.items():
            if np.shape(value) not in ((), (count,)):
                raise SettingError(f"'{name}' has {np.size(value)} values for {count} candidates")
        candidates = Candidates(self, parameters, length)
        for name in values:
            if name not in parameters.found and name not in self.begun:
                raise SettingError(
                    f"the scenario has no parameter '{name}'{suggest_or_list(name, parameters.found)}"
                )
        return candidates.walk()

    def walkers(self, count: int) -> Walkers:
        """So many walkers of the model; kept, as making them takes longer than a walk."""
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
                legs_of(node),
            )
        return self._walkers[count]

    def close(self) -> None:
        """Free the engines."""
        for each in self._walkers.values():
            each.close()
        self._walkers.clear()


class Candidates:
    """Some candidates of a scenario, at their start, which are to walk for a duration (s)."""

    def __init__(self, scenario: Scenario, parameters: Parameters, duration: float) -> None:
        self.scenario, self.parameters, self.duration = scenario, parameters, duration
        self.walkers = walkers = scenario.walkers(parameters.count)
        self._start()
        kind, controller = scenario.controller
        reflexes = Reflexes(controller, kind, walkers, parameters)
        self._steps = round(duration / walkers.step)
        name, own = scenario.measure
        criteria = Criteria(self._steps)
        self.measure: Measure = MEASURES[name](own, walkers, criteria)
        walkers.go_by(*reflexes.pack(), *criteria.pack(), criteria.room)
        node = scenario.settings
        load = node.number("initial_load", 0.2)
        height = walkers.places.get(
            node.text("initial_load_dof", "/jointset/ground_pelvis/pelvis_ty/value")
        )
        if load > 0.0 and height is not None:
            for k in range(walkers.count):
                _settle_on_ground(walkers, k, height, load)

    def _start(self) -> None:
        """States at the start."""
        walkers, node, scenario = self.walkers, self.scenario.settings, self.scenario
        states = walkers.copies.states
        walkers.copies.set_states(slice(None), np.tile(walkers.copies.start, (walkers.count, 1)))
        file = node.text("state_init_file", "")
        if file:
            self._read_state(find_file(file, scenario.folder))
        offset = node.get("initial_state_offset")
        if offset is not None:
            included = node.text("initial_state_offset_include", "*")
            excluded = (
                node.text("initial_state_offset_exclude", "") + ";*/activation;*/fiber_length"
            )
            symmetric = node.flag("initial_state_offset_symmetric", False)
            for path, place in walkers.places.items():
                if matches_pattern(path, included) and not matches_pattern(path, excluded):
                    name = path.replace("_l/", "/").replace("_r/", "/") if symmetric else path
                    states[:, place] += self.parameters.read(offset, f"{name}.offset")

    def _read_state(self, path: Path) -> None:
        walkers = self.walkers
        if path.suffix.lower() == ".sto":
            table = read_sto(path)
            for label in table.columns:
                if label in walkers.places and len(table.times):
                    walkers.copies.states[:, walkers.places[label]] = table[label][0]
            return
        top = read_settings(path)
        for block, ending in (("values", "value"), ("velocities", "speed")):
            part = top.get(block)
            for name, node in part.parts if part is not None else ():
                place = next(
                    (
                        at
                        for full, at in walkers.places.items()
                        if full.endswith(f"/{name}/{ending}")
                    ),
                    None,
                )
                if place is None:
                    raise node.error(
                        f"the model has no coordinate '{name}'{suggest_or_list(name, walkers.coordinates)}"
                    )
                try:
                    walkers.copies.states[:, place] = float(node.value)
                except ValueError:
                    raise node.error(f"'{name}' must be a number, not '{node.value}'") from None

    def walk(self) -> Walked:
        """As of `Scenario.walk`."""
        walkers = self.walkers
        small = self.scenario.settings.number("initial_equilibration_activation", 0.05)
        walkers.equilibrate_muscles(np.full(walkers.excitations.shape, small))
        walkers.go(BEGIN)
        walkers.equilibrate_muscles(walkers.excitations)
        walkers.go(START)
        rows, going = [], list(range(walkers.count))
        for first in range(0, self._steps, AT_ONCE):
            rows.append(walkers.go(min(AT_ONCE, self._steps - first), going))
            going = np.flatnonzero(walkers.progress[:, GOING]).tolist()
            if not going:
                break
        rows.append(
            np.concatenate([walkers.copies.states[0], walkers.excitations[0], walkers.loads()[0]])[
                None
            ]
        )
        times = walkers.step * walkers.progress[:, STEPS].astype(np.float64)
        results = self.measure.add_weighted(times, self.duration) * (
            1.0 if self.measure.minimize else -1.0
        )
        return Walked(
            results,
            times,
            self.measure.terms,
            self.measure.report,
            *self._tables(np.concatenate(rows)),
        )

    def _tables(self, rows: Array) -> tuple[StoTable, StoTable, StoTable]:
        walkers = self.walkers
        times = walkers.step * np.arange(len(rows), dtype=np.float64)
        legs = tuple(f"leg{leg.side}.load" for leg in walkers.legs)
        size = walkers.copies.states.shape[1]
        states, excitations, loads = np.split(rows, (size, size + len(walkers.names)), axis=1)
        return (
            StoTable("states", times, tuple(walkers.places), states[:, [*walkers.places.values()]]),
            StoTable("excitations", times, tuple(walkers.names), excitations),
            StoTable("loads", times, legs, loads),
        )


def read_initial_parameters(optimizer: Node, folder: Path) -> dict[str, tuple[float, float, float]]:
    """Parameters of the files that a search begins with: best, mean and standard deviation."""
    result: dict[str, tuple[float, float, float]] = {}
    for _, init in optimizer.all_of("init"):
        own = read_par(find_file(init.text("file"), folder))
        factor, best = init.number("std_factor", 1.0), init.flag("use_best_as_mean", False)
        result |= {name: (v[0], v[0] if best else v[1], factor * v[2]) for name, v in own.items()}
        init.expect_all_asked("an init")
    return result


def control_step(node: Node) -> float:
    """For which controls are held, s."""
    step = node.number("fixed_control_step_size", 0.005)
    if not SHORTEST <= step < np.inf:
        raise node.error(f"'fixed_control_step_size' is {SHORTEST:g} s or more, not {step:g} s")
    return step


def legs_of(node: Node) -> dict[str, str]:
    """What the legs of a model are called, as :class:`osimlite.studies.reflexes.walkers.Felt` takes it."""
    return {
        "upper": node.text("leg_upper_body", "femur"),
        "lower": node.text("leg_lower_body", ""),
        "contact": node.text("leg_contact_force", "foot"),
    }


def _settle_on_ground(walkers: Walkers, which: int, height: int, load: float) -> None:
    """Move a walker to the height in which the ground carries a part of the weight, as SCONE looks for it."""
    state = walkers.copies.states[which]
    start = float(state[height])

    def carried(value: float) -> float:
        state[height] = value
        walkers.go(FEEL, (which,))
        return float(walkers.loads()[which].sum())

    top = start
    while carried(top) > load and top - start < HIGH:
        top += LIFT
    bottom = top - LIFT
    while carried(bottom) <= load and bottom - start > -HIGH:
        bottom -= LIFT
    for _ in range(TRIES):
        middle = 0.5 * (top + bottom)
        found = carried(middle)
        if abs(found - load) / load <= CLOSE:
            return
        top, bottom = (top, middle) if found > load else (middle, bottom)
    raise SimulationError(f"in no height the ground carries {load:g} of the weight")
