"""Simulating a model: initial state, engine, steps, report."""

from __future__ import annotations

import time
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from math import isfinite
from pathlib import Path
from threading import RLock
from typing import TYPE_CHECKING, Any

from osimlite.base.quantity import warn_caller, warn_of_unit
from osimlite.base.records import replace
from osimlite.errors import SettingError, SimulationError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.constraints import Lock
from osimlite.mechanics.multibody.dynamics import require_numbers
from osimlite.mechanics.multibody.extremes import any_numbers
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.schema.model import Model, expect_model
from osimlite.schema.tree import Snapshot
from osimlite.simulation.constrained import constraints_on, kept_state
from osimlite.simulation.elements import force_elements
from osimlite.simulation.elements.controls import Controls
from osimlite.simulation.engines import engine_factory, engine_name
from osimlite.simulation.engines.protocol import Engine, Settings
from osimlite.simulation.initial_state import (
    ended,
    in_units_of,
    starting,
    state_at,
    state_in,
    suspect_value,
)
from osimlite.simulation.options import (
    DEFAULT_ACCURACY,
    LOOSE,
    MERSON,
    PER_RUN,
    Options,
    check_integrator,
    check_step,
)
from osimlite.simulation.options import report_times as report_times
from osimlite.simulation.run_report import (
    Recorder,
    integration_summary,
    probe_labels,
    probe_rows,
    result_summary,
    versions,
)
from osimlite.simulation.states import in_model_order
from osimlite.simulation.stepper import Observer, Progress, Stepper
from osimlite.simulation.trajectory import Interrupted, Report, Trajectory

if TYPE_CHECKING:
    from osimlite.io.tables.storage import StoTable
    from osimlite.schema.tree import Tree


def simulate(
    model: Model, to: float = 2.0, engine: str | None = None, **choices: Any
) -> Trajectory:
    """Simulate a model forward in time, from its default pose and speeds.

    Constraints, prescribed coordinates and loops are kept up to a tenth of the accuracy. Where the
    start does not fulfil them, it is changed as little as they demand; what `initial` and
    `initial_speeds` say stays.

    Args: model: what moves. to: how long, s. engine: what computes the accelerations: "compiled"
        (the default) or "bullet"; a window (`show`) needs "bullet", which is the default there.
        choices: attributes of :class:`osimlite.simulation.Options`: `accuracy`, `integrator`,
        `fixed_step`, `report_interval`, `initial`, `initial_speeds`, `skip_unsupported` and the
        others.

    Raises: Interrupted: Ctrl-C ended the motion; it has the trajectory up to there. ModelError: the
        model is not a mechanism, or a name does not exist. UnsupportedError: the model has a joint,
        constraint or force that cannot be computed. SimulationError: the motion cannot be computed
        any further (`trajectory` is what was recorded up to there), no pose or speeds fulfil the
        constraints with what was set, or a coordinate that was set is locked or prescribed.
        SettingError: there is no such option, or a setting has no meaning. MissingDependency: what
        the engine works with is not installed.

    What depends on the model alone is computed once and kept until the model changes, so that calls
    in a loop cost a run each; what reads other files is read every time. Threads may call it with
    the same model.
    """
    with _ready(model, engine, choices) as simulation:
        trajectory = simulation.run(
            to, **{name: choices[name] for name in PER_RUN if name in choices}
        )
        simulation.hold()
        return trajectory


KEPT = 8
"""So many models that were simulated last stay ready."""

_READY: list[weakref.ref[Tree]] = []
"""Their trees, the last one last."""


@contextmanager
def _ready(model: Model, engine: str | None, choices: Mapping[str, Any]) -> Iterator[Simulation]:
    """A simulation of a model as it is, which stays ready until the model changes.

    While it runs nobody else has it, so that threads do not meet in it; whose run fails is not
    kept.
    """
    expect_model(model)
    tree, chosen = model.tree(), Options.of(choices)
    engine = None if engine is None else engine_name(engine)
    key = (engine_name(engine), *(getattr(chosen, name) for name in TOLD), chosen.route)
    is_plain = chosen.external_loads is None and not chosen.show
    simulation = tree.kept.pop(key, None) if is_plain else None
    if simulation is None:
        simulation = Simulation(
            model, engine, **{name: choices[name] for name in choices if name not in PER_RUN}
        )
    elif chosen.initial or chosen.initial_speeds:
        simulation.look_again()
    try:
        yield simulation
    except BaseException:
        simulation.close()
        raise
    # Files may change without a word.
    if not is_plain or simulation.forces.reads_files or not tree.is_current:
        simulation.close()
        return
    tree.kept[key] = simulation
    _READY[:] = [known for known in _READY if known() not in (None, tree)] + [weakref.ref(tree)]
    if len(_READY) > KEPT:
        longest_ago = _READY.pop(0)()
        if longest_ago is not None:
            longest_ago.kept.clear()


TOLD = (
    "skip_unsupported",
    "simbody_early_return",
    "own_activation_times",
    "wrapping",
    "opensim_derivatives",
    "rolling",
)
"""What the summary says besides the settings of the run."""


def kept_constraints(mechanism: Mechanism) -> list[str]:
    """Names of what holds besides joints and locks, which not every engine can keep up."""
    return [item.name for item in mechanism.constraints if not isinstance(item, Lock)]


class Simulation:
    """A model made ready to be simulated, any number of times. Close it after use, or use it in a ``with`` statement.

    Args: model: what moves. engine: what computes the accelerations: "compiled" (the default) or
        "bullet"; a window (`show`) needs "bullet", which is the default there. choices: attributes
        of :class:`osimlite.simulation.Options`; those of a run hold where a run does not change
        them.

    Errors are those of :func:`simulate`.

    Attributes:
        options: that were chosen.
        constraints: names of what the coordinates of the state must fulfil.
        paths: of all states, in the order of OpenSim.
    """

    @any_numbers
    def __init__(self, model: Model, engine: str | None = None, **choices: Any) -> None:
        self.options = chosen = Options.of(choices)
        # Only Bullet has a window.
        make = engine_factory("bullet" if chosen.show and engine is None else engine)
        self.mechanism: Mechanism = build_mechanism(
            model, opensim_derivatives=chosen.opensim_derivatives, rolling=chosen.rolling
        )
        # What becomes of the model later changes neither runs nor what is shown of them.
        self._snapshot = Snapshot(model.tree())
        self._lock = RLock()
        _require_finite_start(self.mechanism)
        self.forces = force_elements(
            model,
            self.mechanism,
            skip_unsupported=chosen.skip_unsupported,
            simbody_early_return=chosen.simbody_early_return,
            own_activation_times=chosen.own_activation_times,
            wrapping=chosen.wrapping,
            external_loads=chosen.external_loads,
            folder=chosen.folder,
        )
        visuals = None
        if chosen.show:
            from osimlite.io.meshes.folders import MeshFolders
            from osimlite.simulation.robot.mesh_files import MeshFiles
            from osimlite.simulation.robot.visuals import collect_visuals

            places = MeshFolders(Path.cwd() if chosen.folder is None else Path(chosen.folder))
            visuals = collect_visuals(model, self.mechanism, mesh_files=MeshFiles(places))
        self.engine: Engine = make(
            self.mechanism,
            self.forces,
            Settings(route=chosen.route, show=chosen.show, visuals=visuals),
        )
        self.state = self.engine.state
        self.constraints = [
            item.name for item in constraints_on(self.mechanism, self.engine.order)[0]
        ]
        paths = [
            f"{info.path}/{what}"
            for info in self.mechanism.coordinates
            for what in ("value", "speed")
        ]
        named = [variable.path for variable in self.state.variables if variable.is_named]
        self.paths = in_model_order(model, paths + named)
        self._start: tuple[Any, tuple[list[float], list[float]]] | None = None
        self._has_inertia = False

    @property
    def model(self) -> Model:
        """A copy of what moves."""
        return self._snapshot.model

    def run(self, to: float = 2.0, **choices: Any) -> Trajectory:
        """Simulate once.

        Args: to: how long, s. choices: attributes of :class:`osimlite.simulation.Options` that can
            be chosen for every run.

        Errors are those of :func:`simulate`.
        """
        with self._lock:
            return self._run(to, self.options.for_run(choices))

    def _run(self, to: float, chosen: Options) -> Trajectory:
        started = time.perf_counter()
        fixed_step, initial = chosen.fixed_step, chosen.initial
        start, before = 0.0, None
        if chosen.resume is not None:
            if initial or chosen.initial_speeds or chosen.equilibrate:
                raise SettingError(
                    "a simulation that goes on starts where the other one ended; say no other start"
                )
            earlier, before = ended(chosen.resume)
            start = float(earlier.times[-1]) if len(earlier.times) else 0.0
            initial = self.state_of(earlier)
        held = None
        if chosen.controller is not None:
            if fixed_step is not None:
                raise SettingError(
                    "a controller needs the steps of an integrator; leave out the fixed step"
                )
            if isinstance(chosen.controller, str | Path | Mapping):
                such = f"osimlite.Feedback({chosen.controller!r})"
                raise SettingError(f"a controller is an osimlite.Feedback, such as {such}")
            held = chosen.controller.compile_for(self.model, self.engine)
            to = held.nearest(to)
            if chosen.resume is not None:
                held.require_known(before, start)
        elif before is not None:
            raise SettingError("the run that this one goes on from had a controller; give it, too")
        times = report_times(to, chosen.report_interval, start)
        if fixed_step is not None:
            check_step(fixed_step, to)
            for name in ("accuracy", "integrator"):
                if getattr(chosen, name) is not None:
                    raise SettingError(
                        f"the {name} means nothing for a fixed step; leave one of them out"
                    )
        accuracy = DEFAULT_ACCURACY if chosen.accuracy is None else chosen.accuracy
        integrator = MERSON if chosen.integrator is None else chosen.integrator
        check_integrator(integrator)
        if fixed_step is None and LOOSE < accuracy < 1.0:
            warn_caller(
                f"an accuracy of {accuracy:g} is so loose that a motion may end far from the model's own; "
                f"take {LOOSE:g} or less"
            )
        if chosen.show and fixed_step is None:
            raise SettingError("showing the motion needs a fixed step, for instance 0.001 s")
        if isinstance(initial, str | Path):
            initial = self.state_in(initial)
        for name, value in (initial or {}).items():
            if name not in self.paths:
                info = self.mechanism.coordinates[self.mechanism.coordinate_index(name)]
                warn_of_unit(suspect_value(info, name, value))
        initial, initial_speeds = (
            {
                name: float(value)
                if name in self.paths
                else in_units_of(self.mechanism, name, value)
                for name, value in (given or {}).items()
            }
            for given in (initial, chosen.initial_speeds)
        )
        controls, given = self.forces.controls, {}
        if chosen.controls is not None or any(controls.functions):
            from osimlite.simulation.run_controls import driven, told

            controls = driven(controls, chosen.controls, to)
            given = {} if chosen.controls is None else {"controls": told(chosen.controls)}
        if chosen.controller is not None:
            given["controller"] = str(chosen.controller)
        if chosen.resume is not None:
            given["resume"] = str(chosen.resume)
        opened = controls if held is None else held.open_to(controls)
        self.engine.drive(opened)
        y = self.initial_state(initial, initial_speeds, equilibrate=chosen.equilibrate)
        self._require_inertia(y)
        settings = Settings(accuracy, integrator, fixed_step, self.engine.route, chosen.show)
        runs = None if held is None else held.runs(self.engine, opened, to, before)
        recorder, stepper, states = self._moved(
            y, replace(settings, held=runs), times, chosen.progress
        )
        if runs is not None:
            controls = runs.added_to(controls)
        times = times[: len(states)]
        if times[-1] < stepper.time:
            # Where it was ended, which somebody may want to go on from.
            times, states = [*times, stepper.time], [*states, stepper.state]
        table = None if runs is None else runs.table(times[-1])
        if not isfinite(sum(states[-1])):
            raise SimulationError("the motion is not finite any more; ask for more accuracy")
        wall = time.perf_counter() - started
        wanted = {
            "to": to,
            **(
                {"accuracy": accuracy, "integrator": integrator}
                if fixed_step is None
                else {"fixed_step": fixed_step}
            ),
            "report_interval": chosen.report_interval,
            "initial": initial,
            "initial_speeds": initial_speeds,
            **({"equilibrate": True} if chosen.equilibrate else {}),
            **given,
            **{name: getattr(chosen, name) for name in TOLD},
            **(
                {}
                if chosen.external_loads is None
                else {"external_loads": str(chosen.external_loads)}
            ),
        }
        trajectory = self._trajectory(
            times, states, stepper, recorder, wanted, wall, controls, table
        )
        if isinstance(stepper.ended, SimulationError):
            stepper.ended.trajectory = trajectory if stepper.taken else None
            raise stepper.ended
        if stepper.ended is not None:
            raise Interrupted(trajectory)
        return trajectory

    def every_step(
        self, start: float, y: Sequence[float], to: float, settings: Settings
    ) -> tuple[list[float], list[list[float]], SimulationError | None]:
        """Follow a motion from a time other than 0, and keep all steps.

        Args:
            start: time at which it begins, s.
            y: the state then, in the engine's order, where the constraints hold.
            to: end of the motion, s.
            settings: how to step.

        Returns: Times (s) and states of the start and of the ends of all steps, and what ended the
            motion before its end.

        Raises:
            SimulationError: it cannot begin.
        """
        from osimlite.simulation.run_controls import require_tables

        times, states = [start], [list(y)]

        def note(t: float, y: list[float]) -> None:
            times.append(t)
            states.append(y)

        with self._lock:
            require_tables(self.forces.controls, start, to)
            self._require_inertia(y)
            stepper = self._stepper(start, y, settings, note)
            stepper.table([to])
            stepper.catch_up()
        if isinstance(stepper.ended, KeyboardInterrupt):
            raise stepper.ended
        return times, states, stepper.ended

    def look_again(self) -> None:
        """Have the next start checked, too, for motions without inertia."""
        self._has_inertia = False

    def hold(self) -> None:
        """Keep the last pose in the window until somebody closes it; nothing without a window."""
        if self.options.show:
            with suppress(KeyboardInterrupt):
                self.engine.hold()

    def close(self) -> None:
        """Free what the engine holds; trajectories stay good."""
        self.engine.close()

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # --------------------------------------------------------------------------------------------- helpers
    @any_numbers
    def _moved(
        self, y: list[float], settings: Settings, times: Sequence[float], progress: Progress | None
    ) -> tuple[Recorder, Stepper, Sequence[Any]]:
        """What was recorded and integrated from a state, and the states at times (s)."""
        recorder = Recorder(self.engine)
        stepper = self._stepper(times[0], y, settings, recorder.observe)
        recorder.begin(stepper)
        return recorder, stepper, stepper.table(times, progress)

    @any_numbers
    def _stepper(
        self, start: float, y: Sequence[float], settings: Settings, observe: Observer
    ) -> Stepper:
        return self.engine.stepper(start, list(y), settings, observe)

    @any_numbers
    def _require_inertia(self, y: Sequence[float]) -> None:
        """SimulationError, the same for all engines, if the first start is one where a motion has no inertia."""
        if not self._has_inertia:
            self.mechanism.acceleration(self.state.values(y), self.state.speeds(y))
            self._has_inertia = True

    @any_numbers
    def initial_state(
        self,
        initial: Mapping[str, float],
        speeds: Mapping[str, float],
        *,
        equilibrate: bool = False,
    ) -> list[float]:
        """State in the engine's order (y,): default values and speeds, and what follows from them, but for those given.

        Args: initial: values (rad, m) of coordinates by name or path, and any states by their paths
            in ``states.sto``. speeds: generalized speeds of coordinates by name or path.
            equilibrate: whether states that are not given start in equilibrium where they have one.

        Raises: ModelError: there is no such coordinate. SimulationError: a coordinate is locked or
            prescribed, a number is not finite, no pose or speeds fulfil the constraints, or a
            muscle has no equilibrium.
        """
        own = {path: initial[path] for path in self.state.paths if path in initial}
        q, u, places = starting(
            self.mechanism, {name: initial[name] for name in initial if name not in own}, speeds
        )
        given = u
        if self.constraints:
            # To find the nearest pose can take as long as the motion: the same start is not looked
            # for again.
            start = (q, u, places)
            if self._start is None or self._start[0] != start:
                values, rates = kept_state(self.mechanism, q, u, *places)
                self._start = start, (values.tolist(), rates.tolist())
            q, u = self._start[1]
        y = self.state.pack(q, u)
        moving = 2 * len(self.state.order)
        numbers = {path: number for number, path in enumerate(self.state.paths, moving)}
        for path, number in numbers.items():
            y[number] = float(own.get(path, y[number]))
            if not isfinite(y[number]):
                raise SettingError(f"the state '{path}' starts at {y[number]}; give a number")
        if equilibrate:
            # OpenSim does so in the assembled pose, before it makes the speeds fulfil the
            # constraints.
            infos = self.mechanism.coordinates
            given = [
                u[k] if info.locked or info.prescribed is not None else given[k]
                for k, info in enumerate(infos)
            ]
            y[moving:] = self.engine.equilibrated(
                0.0, [*self.state.pack(q, given)[:moving], *y[moving:]]
            )[moving:]
            for path, value in own.items():
                y[numbers[path]] = float(value)
        return y

    def state_in(self, path: str | Path, time: float | None = None) -> dict[str, float]:
        """A state of a file such as ``states.sto``, as `run` takes it for `initial`; see :func:`state_in`."""
        return state_in(path, self.mechanism, self.paths, time)

    def state_of(self, table: StoTable) -> dict[str, float]:
        """The last state of a table in SI units, likewise."""
        return state_at(table, self.mechanism, self.paths)

    def _trajectory(
        self,
        times: list[float],
        states: Sequence[Any],
        stepper: Stepper,
        recorder: Recorder,
        settings: dict[str, Any],
        wall: float,
        controls: Controls,
        controller: StoTable | None,
    ) -> Trajectory:
        def asked(what: Callable[[Engine], Any]) -> Any:
            """What the engine says, as it was in this run: since then there may have been others."""
            with self._lock:
                self.engine.drive(controls)
                return what(self.engine)

        def summary(engine: Engine) -> dict[str, Any]:
            return {
                "model": self.mechanism.name,
                "engine": engine.name,
                "route": engine.route,
                **integration_summary(stepper, settings, wall),
                **result_summary(engine, recorder, (times[0], states[0]), (times[-1], states[-1])),
                "skipped_forces": list(self.forces.skipped),
                "constraints": self.constraints,
                "versions": versions(engine),
            }

        report = Report(
            lambda: asked(lambda engine: (engine.columns, engine.force_table(times, states))),
            lambda: asked(lambda engine: list(map(engine.energies, times, states))),
            lambda: asked(
                lambda engine: (
                    probe_labels(engine.probes),
                    list(
                        probe_rows(engine, list(zip(times, states, strict=True)), recorder.steps())
                    ),
                )
            ),
            lambda: asked(summary),
        )
        values, speeds = self.state.histories(states)
        auxiliary = self.state.auxiliary_histories(states)
        return Trajectory(
            self.mechanism,
            times,
            values,
            speeds,
            report,
            auxiliary,
            self.paths,
            self._snapshot,
            controller,
        )


@any_numbers
def _require_finite_start(mechanism: Mechanism) -> None:
    """SimulationError if no engine can compute with the numbers of a mechanism."""
    for what in ("value", "speed"):
        for info in mechanism.coordinates:
            number = getattr(info, f"default_{what}")
            if not isfinite(number):
                raise SimulationError(
                    f"the default {what} of coordinate '{info.path}' is {number}; give a number"
                )
    require_numbers(mechanism, mechanism.mass_matrix({}))
