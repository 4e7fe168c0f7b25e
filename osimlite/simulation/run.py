"""Prepared simulation of a model: options, initial state, engine, steps and report."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from math import isfinite
from pathlib import Path
from threading import RLock
from typing import TYPE_CHECKING, Any

from osimlite.base.progress import report_progress
from osimlite.base.quantity import warn_caller, warn_of_unit
from osimlite.errors import SettingError, SimulationError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.constraints import Lock
from osimlite.mechanics.multibody.dynamics import require_numbers
from osimlite.mechanics.multibody.extremes import any_numbers
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.schema.model import Model
from osimlite.schema.tree import Snapshot
from osimlite.simulation.constrained import find_consistent_state, select_constraints
from osimlite.simulation.elements import force_elements
from osimlite.simulation.elements.controls import Controls
from osimlite.simulation.engines import engine_factory
from osimlite.simulation.engines.protocol import Engine, EngineSettings
from osimlite.simulation.initial_state import (
    convert_state,
    convert_value,
    describe_suspect_activations,
    describe_suspect_value,
    extract_state,
    find_suspect_activations,
    read_earlier_run,
    read_state,
    resolve_initial_values,
)
from osimlite.simulation.options import (
    LOOSEST_SOUND_ACCURACY,
    Options,
    check_fixed_step,
)
from osimlite.simulation.options import compute_report_times as report_times
from osimlite.simulation.run_report import (
    Recorder,
    collect_versions,
    compute_probe_rows,
    list_probe_labels,
    summarize_integration,
    summarize_result,
)
from osimlite.simulation.states import sort_by_component
from osimlite.simulation.stepper import Observer, Progress, Stepper
from osimlite.simulation.trajectory import Interrupted, Trajectory, TrajectoryReports

if TYPE_CHECKING:
    from osimlite.io.tables.storage import StoTable


SUMMARY_OPTIONS = (
    "skip_unsupported",
    "simbody_early_return",
    "own_activation_times",
    "wrapping",
    "opensim_derivatives",
    "rolling",
)
"""Options of the prepared model that `Trajectory.summary` repeats."""


def list_constraints(mechanism: Mechanism) -> list[str]:
    """Return the names of the constraints that not every engine supports.

    Args:
        mechanism: the mechanism.

    Returns:
        Names of all constraints except locks, in the order of the mechanism.
    """
    return [item.name for item in mechanism.constraints if not isinstance(item, Lock)]


class Simulation:
    """A model that is prepared once and simulated any number of times.

    Close it after use, or use it in a ``with`` statement. It raises the errors of
    :func:`osimlite.simulate`.

    Args:
        model: model to simulate; later changes of it have no effect.
        engine: engine that computes the accelerations: "compiled" (the default) or "bullet". A
            window (`show`) needs "bullet", which is the default there.
        choices: attributes of :class:`osimlite.simulation.Options`. Those in `RUN_OPTIONS` are
            defaults, which each run may override.

    Attributes:
        options: the options.
        constraints: names of the constraints on the coordinates of the state.
        paths: paths of all states, in OpenSim's order.
    """

    @any_numbers
    def __init__(self, model: Model, engine: str | None = None, **choices: Any) -> None:
        self.options = options = Options.parse(choices)
        # Only Bullet has a window.
        create_engine = engine_factory("bullet" if options.show and engine is None else engine)
        self.mechanism: Mechanism = build_mechanism(
            model, opensim_derivatives=options.opensim_derivatives, rolling=options.rolling
        )
        # Later changes of the model affect neither runs nor their display.
        self._snapshot = Snapshot(model.tree())
        self._lock = RLock()
        _require_finite_start(self.mechanism)
        # Forces need the mechanism; the engine then packs both for the kernels.
        self.forces = force_elements(
            model,
            self.mechanism,
            skip_unsupported=options.skip_unsupported,
            simbody_early_return=options.simbody_early_return,
            own_activation_times=options.own_activation_times,
            wrapping=options.wrapping,
            external_loads=options.external_loads,
            folder=options.folder,
        )
        visuals = None
        if options.show:
            from osimlite.io.meshes.folders import MeshFolders
            from osimlite.simulation.robot.mesh_files import MeshFiles
            from osimlite.simulation.robot.visuals import collect_visuals

            mesh_folders = MeshFolders(
                Path.cwd() if options.folder is None else Path(options.folder)
            )
            visuals = collect_visuals(model, self.mechanism, mesh_files=MeshFiles(mesh_folders))
        self.engine: Engine = create_engine(
            self.mechanism,
            self.forces,
            EngineSettings(route=options.route, show=options.show, visuals=visuals),
        )
        self.state = self.engine.state
        self.constraints = [
            item.name for item in select_constraints(self.mechanism, self.engine.order)[0]
        ]
        paths = [
            f"{info.path}/{quantity}"
            for info in self.mechanism.coordinates
            for quantity in ("value", "speed")
        ]
        named = [variable.path for variable in self.state.variables if variable.is_named]
        self.paths = sort_by_component(model, paths + named)
        self._start: tuple[Any, tuple[list[float], list[float]]] | None = None
        self._has_inertia = False

    @property
    def model(self) -> Model:
        """Copy of the model as it was when the simulation was prepared."""
        return self._snapshot.model

    def run(self, to: float = 2.0, **choices: Any) -> Trajectory:
        """Simulate the model once.

        Args:
            to: end of the motion, s.
            choices: attributes of :class:`osimlite.simulation.Options` that are in `RUN_OPTIONS`.

        Returns:
            The motion. Errors are those of :func:`osimlite.simulate`.
        """
        with self._lock:
            return self._simulate_once(to, self.options.override_for_run(choices))

    def _simulate_once(self, to: float, options: Options) -> Trajectory:
        started = time.perf_counter()
        fixed_step, initial = options.fixed_step, options.initial
        start, earlier_record = 0.0, None
        if options.resume is not None:
            if initial or options.initial_speeds or options.equilibrate:
                raise SettingError(
                    "a resumed simulation starts where the earlier one ended; leave out initial values, speeds and equilibrate"
                )
            earlier, earlier_record = read_earlier_run(options.resume)
            start = float(earlier.times[-1]) if len(earlier.times) else 0.0
            initial = self.get_last_state(earlier)
        controller = None
        if options.controller is not None:
            if fixed_step is not None:
                raise SettingError(
                    "a controller needs the steps of an integrator; leave out the fixed step"
                )
            if isinstance(options.controller, str | Path | Mapping):
                example = f"osimlite.Feedback({options.controller!r})"
                raise SettingError(f"a controller is an osimlite.Feedback, such as {example}")
            controller = options.controller.compile_for(self.model, self.engine)
            to = controller.snap_to_step(to)
            if options.resume is not None:
                controller.require_same_controller(earlier_record, start)
        elif earlier_record is not None:
            raise SettingError("the earlier run had a controller; pass the same one to resume it")
        # A controller has moved `to` onto a control step before the rows are chosen.
        times = report_times(to, options.report_interval, start)
        if fixed_step is not None:
            check_fixed_step(fixed_step, to)
        options.check_integration()
        # A warning instead of an error: OpenSim accepts any accuracy below 1.
        if fixed_step is None and options.accuracy > LOOSEST_SOUND_ACCURACY:
            warn_caller(
                f"an accuracy of {options.accuracy:g} is so loose that the computed motion may differ greatly "
                f"from the exact one; use {LOOSEST_SOUND_ACCURACY:g} or less"
            )
        if options.show and fixed_step is None:
            raise SettingError("showing the motion needs a fixed step, for instance 0.001 s")
        if isinstance(initial, str | Path):
            initial = self.read_state(initial)
        requested = initial or {}
        initial, initial_speeds = (
            {
                name: convert_state(name, value)
                if name in self.paths
                else convert_value(self.mechanism, name, value, is_speed=is_speed)
                for name, value in numbers.items()
            }
            for numbers, is_speed in ((requested, False), (options.initial_speeds or {}, True))
        )
        for name, value in requested.items():
            if name not in self.paths:
                info = self.mechanism.coordinates[self.mechanism.coordinate_index(name)]
                warn_of_unit(describe_suspect_value(info, name, value))
        # The model is copied at its first use here, which takes longer than the check.
        suspect_values = find_suspect_activations(requested)
        if suspect_values and (message := describe_suspect_activations(self.model, suspect_values)):
            warn_caller(message)
        controls = self.forces.controls
        extra_settings = {}
        if options.controls is not None or any(controls.functions):
            from osimlite.simulation.run_controls import add_controls, describe_controls

            controls = add_controls(controls, options.controls, to)
            extra_settings = (
                {}
                if options.controls is None
                else {"controls": describe_controls(options.controls)}
            )
        if options.controller is not None:
            extra_settings["controller"] = str(options.controller)
        if options.resume is not None:
            extra_settings["resume"] = str(options.resume)
        # The engine sees one constant per control of the controller, which the kernels overwrite at
        # each control step. The trajectory gets the recorded values instead.
        run_controls = controls if controller is None else controller.add_constants(controls)
        self.engine.set_controls(run_controls)
        y = self.initial_state(initial, initial_speeds, equilibrate=options.equilibrate)
        self._require_inertia(y)
        runs = (
            None
            if controller is None
            else controller.make_runs(self.engine, run_controls, to, earlier_record)
        )
        settings = EngineSettings(
            fixed_step=fixed_step,
            route=self.engine.route,
            show=options.show,
            controller_runs=runs,
            **options.integration_choices(),
        )
        recorder, stepper, states = self._integrate_motion(y, settings, times, options.progress)
        if runs is not None:
            controls = runs.add_record(controls)
        times = times[: len(states)]
        if times[-1] < stepper.time:
            # The last time that was reached, so that another run can continue there.
            times, states = [*times, stepper.time], [*states, stepper.state]
        table = None if runs is None else runs.table(times[-1])
        # One sum instead of a test of each entry: a NaN or an infinity survives addition.
        if not isfinite(sum(states[-1])):
            raise SimulationError(
                "the motion has become infinite or NaN; use a smaller accuracy value"
            )
        wall = time.perf_counter() - started
        summary_settings = {
            "to": to,
            **(options.summarize_choices() if fixed_step is None else {"fixed_step": fixed_step}),
            "report_interval": options.report_interval,
            "initial": initial,
            "initial_speeds": initial_speeds,
            **({"equilibrate": True} if options.equilibrate else {}),
            **extra_settings,
            **{name: getattr(options, name) for name in SUMMARY_OPTIONS},
            **(
                {}
                if options.external_loads is None
                else {"external_loads": str(options.external_loads)}
            ),
        }
        trajectory = self._make_trajectory(
            times, states, stepper, recorder, summary_settings, wall, controls, table
        )
        # An error without a single step has no motion to show.
        if isinstance(stepper.ended, SimulationError):
            stepper.ended.trajectory = trajectory if stepper.accepted else None
            raise stepper.ended
        if stepper.ended is not None:
            raise Interrupted(trajectory)
        return trajectory

    def record_every_step(
        self, start: float, y: Sequence[float], to: float, settings: EngineSettings
    ) -> tuple[list[float], list[list[float]], SimulationError | None]:
        """Integrate from any time and state, and record the end of every step.

        Args:
            start: start time, s.
            y: initial state in the engine's order; it must fulfil the constraints.
            to: end of the motion, s.
            settings: settings of the integration.

        Returns:
            Times (s), the states at the start and at the end of each step, and the error that ended
            the motion early, if any.

        Raises:
            SimulationError: the motion cannot begin.
        """
        from osimlite.simulation.run_controls import require_table_span

        times = [start]
        states = [list(y)]

        def note(t: float, y: list[float]) -> None:
            times.append(t)
            states.append(y)

        with self._lock:
            require_table_span(self.forces.controls, start, to)
            self._require_inertia(y)
            stepper = self._make_stepper(start, y, settings, note)

            def report(t: float, _: float) -> None:
                report_progress("integrating", t - start, to - start, " s")

            stepper.tabulate([to], report)
            stepper.catch_up()
        if isinstance(stepper.ended, KeyboardInterrupt):
            raise stepper.ended
        return times, states, stepper.ended

    def reset_inertia_check(self) -> None:
        """Check the next initial state again for motions without inertia."""
        self._has_inertia = False

    def hold(self) -> None:
        """Keep the window with the last pose open until the user closes it; do nothing without a window."""
        if self.options.show:
            with suppress(KeyboardInterrupt):
                self.engine.hold_window()

    def close(self) -> None:
        """Free the engine; trajectories stay valid."""
        self.engine.close()

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # --------------------------------------------------------------------------------------------- helpers
    @any_numbers
    def _integrate_motion(
        self,
        y: list[float],
        settings: EngineSettings,
        times: Sequence[float],
        progress: Progress | None,
    ) -> tuple[Recorder, Stepper, Sequence[Any]]:
        """Integrate from a state.

        Args:
            y: initial state (y,).
            settings: settings of the integration.
            times: times of the rows, s; the first one is the start.
            progress: function that is called with simulated time and step length (s); None for
                none.

        Returns:
            The recorder and the stepper after the motion, and the states (y,) at the times.
        """
        recorder = Recorder(self.engine)
        stepper = self._make_stepper(times[0], y, settings, recorder.observe_step)
        recorder.start(stepper)
        return recorder, stepper, stepper.tabulate(times, progress)

    @any_numbers
    def _make_stepper(
        self, start: float, y: Sequence[float], settings: EngineSettings, observe: Observer
    ) -> Stepper:
        return self.engine.make_stepper(start, list(y), settings, observe)

    @any_numbers
    def _require_inertia(self, y: Sequence[float]) -> None:
        """Check that the first initial state allows no motion without inertia.

        With this check all engines give the same error; Bullet would compute a motion.

        Args:
            y: initial state (y,).

        Raises:
            SimulationError: an admissible motion moves no mass.
        """
        if not self._has_inertia:
            # The mechanism in Python explains singular mass matrices. It is slow, so it runs for
            # one state.
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
        """Return an initial state: the requested values, and default values for the others.

        Args:
            initial: values (rad, m) of coordinates by name or path, and any states by their paths
                in ``states.sto``.
            speeds: generalized speeds of coordinates by name or path.
            equilibrate: whether muscle states that `initial` does not name start in equilibrium.

        Returns:
            The state (y,) in the engine's order. It fulfils the constraints.

        Raises:
            ModelError: there is no such coordinate.
            SettingError: a coordinate is set twice, or a number is not finite.
            SimulationError: a coordinate is locked or prescribed, no pose or speeds fulfil the
                constraints, or a muscle has no equilibrium.
        """
        auxiliary_values = {path: initial[path] for path in self.state.paths if path in initial}
        q, u, set_indices = resolve_initial_values(
            self.mechanism,
            {name: initial[name] for name in initial if name not in auxiliary_values},
            speeds,
        )
        requested_speeds = u
        if self.constraints:
            # Assembly can take as long as the motion, so the result is cached for the same start.
            start = (q, u, set_indices)
            if self._start is None or self._start[0] != start:
                values, rates = find_consistent_state(self.mechanism, q, u, *set_indices)
                self._start = start, (values.tolist(), rates.tolist())
            q, u = self._start[1]
        y = self.state.pack(q, u)
        moving_count = 2 * len(self.state.order)
        numbers = {path: number for number, path in enumerate(self.state.paths, moving_count)}
        for path, number in numbers.items():
            y[number] = float(auxiliary_values.get(path, y[number]))
            if not isfinite(y[number]):
                raise SettingError(f"the state '{path}' starts at {y[number]}; give a number")
        if equilibrate:
            # OpenSim equilibrates in the assembled pose, before it projects the speeds onto the
            # constraints.
            infos = self.mechanism.coordinates
            requested_speeds = [
                u[k] if info.locked or info.prescribed is not None else requested_speeds[k]
                for k, info in enumerate(infos)
            ]
            y[moving_count:] = self.engine.equilibrate_muscles(
                0.0, [*self.state.pack(q, requested_speeds)[:moving_count], *y[moving_count:]]
            )[moving_count:]
            for path, value in auxiliary_values.items():
                y[numbers[path]] = float(value)
        return y

    def read_state(self, path: str | Path, time: float | None = None) -> dict[str, float]:
        """Return a state of a file such as ``states.sto`` in the form of `initial`.

        Args:
            path: file with a table of states.
            time: time of the state, s; the nearest row is used. The last row if None.

        Returns:
            Values in SI units (rad, m) by path.

        Raises:
            DocumentError: the file is not a table of states of this model.
        """
        return read_state(path, self.mechanism, self.paths, time)

    def get_last_state(self, table: StoTable) -> dict[str, float]:
        """Return the last state of a table, in the form of `initial`.

        Args:
            table: table of states.

        Returns:
            Values in SI units (rad, m) by path.
        """
        return extract_state(table, self.mechanism, self.paths)

    def _make_trajectory(
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
        # Reports are computed when they are first read, which may be after the next run.
        def evaluate_with_controls(function: Callable[[Engine], Any]) -> Any:
            """Return the value of a function of the engine under the controls of this run.

            Later runs may have set other controls.
            """
            with self._lock:
                self.engine.set_controls(controls)
                return function(self.engine)

        def summary(engine: Engine) -> dict[str, Any]:
            return {
                "model": self.mechanism.name,
                "engine": engine.name,
                "route": engine.route,
                **summarize_integration(stepper, settings, wall),
                **summarize_result(
                    engine, recorder, (times[0], states[0]), (times[-1], states[-1])
                ),
                "skipped_forces": list(self.forces.skipped),
                "constraints": self.constraints,
                "versions": collect_versions(engine),
            }

        report = TrajectoryReports(
            lambda: evaluate_with_controls(
                lambda engine: (engine.columns, engine.force_table(times, states))
            ),
            lambda: evaluate_with_controls(
                lambda engine: list(map(engine.compute_energies, times, states))
            ),
            lambda: evaluate_with_controls(
                lambda engine: (
                    list_probe_labels(engine.probes),
                    list(
                        compute_probe_rows(
                            engine, list(zip(times, states, strict=True)), recorder.get_steps()
                        )
                    ),
                )
            ),
            lambda: evaluate_with_controls(summary),
        )
        values, speeds = self.state.extract_histories(states)
        auxiliary = self.state.extract_auxiliary(states)
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
    """Check that default values, default speeds and the mass matrix are finite numbers.

    Raises:
        SimulationError: a number is infinite or NaN.
    """
    for quantity in ("value", "speed"):
        for info in mechanism.coordinates:
            number = getattr(info, f"default_{quantity}")
            if not isfinite(number):
                raise SimulationError(
                    f"the default {quantity} of coordinate '{info.path}' is {number}; give a number"
                )
    require_numbers(mechanism, mechanism.mass_matrix({}))
