"""Steps that the tools of dynamics share: model, simulation, states and analyses of a setup."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.progress import watch_items
from osimlite.base.text import add_article, join_words
from osimlite.io.tables.storage import StoTable, read_sto
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.base import Object
from osimlite.schema.forces import Actuator
from osimlite.schema.model import Model
from osimlite.schema.resolution import is_a
from osimlite.schema.sets import Controller
from osimlite.schema.specs import get_file_specs
from osimlite.schema.tools.dynamics import AbstractTool
from osimlite.simulation.initial_state import match_state_columns, resolve_initial_values
from osimlite.simulation.inverse_dynamics import add_forces
from osimlite.simulation.recorded_motion import RecordedMotion
from osimlite.simulation.run import Simulation
from osimlite.simulation.static_optimization import StaticOptimization
from osimlite.tools.evidence import Evidence
from osimlite.tools.job import Job
from osimlite.tools.motion import AnalysisTables, Motion
from osimlite.tools.outcome import Outcome
from osimlite.tools.registry import ANALYSES, import_function

Analyses = list[tuple[Any, Callable[[Any, Motion, AnalysisTables], None]]]
"""Analyses of a setup, each with the function that computes and writes it."""


def find_analyses(job: Job) -> Analyses:
    """Return the analyses of a setup that are on.

    Raises:
        NotRunnable: osimlite cannot compute one of them.
    """
    setup: AbstractTool = job.setup
    result = []
    for analysis in setup.analysis_set.objects:
        if analysis.on:
            class_name = type(analysis).__name__
            if class_name not in ANALYSES:
                raise job.create_unsupported_error(
                    f"the analysis '{analysis.name}' is {add_article(class_name)}, which osimlite cannot compute yet; "
                    "switch it off with <on>false</on>"
                )
            result.append((analysis, import_function(ANALYSES[class_name])))
    return result


def compute_analyses(
    job: Job, outcome: Outcome, analyses: Analyses, motion: Motion, first_row: int = 0
) -> None:
    """Compute analyses along the rows of a motion.

    As in OpenSim, an analysis has the first and the last row, and between them the rows whose
    number is a multiple of its `step_interval`. Its `start_time` and `end_time` have no effect.

    Args:
        job: setup of the tool.
        outcome: outcome to which the tables are added.
        analyses: analyses with the functions that compute them.
        motion: motion with all rows.
        first_row: number of the first row in the file of the motion.
    """
    # OpenSim counts rows from the start of the file, not of the range that is analysed.
    numbers = np.arange(first_row, first_row + len(motion.times))
    for analysis, write in analyses:
        selected_motion = motion
        # OpenSim takes 0 and negative numbers as 1.
        if analysis.step_interval > 1:
            selected = numbers % analysis.step_interval == 0
            # OpenSim always analyses the first and the last row.
            selected[[0, -1]] = True
            selected_motion = motion.select_times(selected)
        write(
            analysis,
            selected_motion,
            AnalysisTables(
                job, outcome, analysis.name, selected_motion.times, describe_gaps(selected_motion)
            ),
        )


def describe_gaps(motion: Motion) -> str:
    """Return the note in the header of a table about missing numbers; "" if none is missing.

    Numbers are missing where fiber and tendon of a muscle have no equilibrium.
    """
    if not motion.unbalanced:
        return ""
    names = join_words([path.rpartition("/")[2] for path in motion.unbalanced])
    return f"NaN: no equilibrium of fibers and tendon was found for {names} at this time, and the value depends on it.\n"


def build_model(job: Job) -> Model:
    """Return the model of a setup with the forces and controllers that the setup adds.

    Raises:
        NotRunnable: the model has a CorrectionController that is enabled.
    """
    setup: AbstractTool = job.setup
    paths = [path for name in setup.force_set_files if (path := job.resolve_name(name)) is not None]
    model = job.read_model()
    add_forces(model, paths, replace=setup.replace_force_set)
    for controller in setup.controller_set.objects:
        # The setup keeps its controllers as they are in its file.
        controller_copy = _resolve_files(job, controller.copy_deep())
        actuators = list(model.components(Actuator))
        # Older setups request all actuators by one word; their names are known from the model
        # only.
        functions = (
            controller_copy.ControlFunctions.objects
            if is_a(controller_copy, "PrescribedController")
            else []
        )
        if functions and not controller_copy.socket_actuators and len(functions) == len(actuators):
            controller_copy.socket_actuators = tuple(actuators)
        model.controller_set.objects.append(controller_copy)
    for controller in model.components(Controller):
        if is_a(controller, "CorrectionController") and controller.enabled:
            raise job.create_unsupported_error(
                f"osimlite cannot compute the CorrectionController '{controller.name}' yet; set "
                "<enabled>false</enabled>"
            )
    return model


def _resolve_files(job: Job, setup_object: Object) -> Any:
    """Make the paths in an object of the setup absolute, starting from the folder of the setup.

    The model that the object joins may be in another folder.

    Args:
        job: setup of the tool, with the paths of its files.
        setup_object: object of the setup; it is changed in place.

    Returns:
        `setup_object` itself.
    """
    for component in setup_object.walk():
        for spec in get_file_specs(type(component), "file"):
            path = job.resolve_name(str(getattr(component, spec.name) or ""))
            if path is not None:
                component.assign(spec.name, str(path.absolute()))
    return setup_object


def build_simulation(job: Job, model: Model) -> Simulation:
    """Return the simulation of a model under the loads of a setup, with OpenSim's known errors.

    The results of tools are to have OpenSim's numbers.

    Args:
        job: setup of the tool, with the paths of its files.
        model: model of the setup.
    """
    return Simulation(
        model,
        "compiled",
        external_loads=job.find_path("external_loads_file"),
        folder=job.require_path("model_file").parent,
        opensim_derivatives=True,
        simbody_early_return=True,
    )


def build_static_optimization(
    job: Job, model: Model, mechanism: Mechanism, **options: Any
) -> StaticOptimization:
    """Return the static optimization of a model under the loads of a setup, as in OpenSim.

    Args:
        job: setup of the tool, with the paths of its files.
        model: model of the setup.
        mechanism: mechanism of the model.
        options: options of :class:`StaticOptimization`.
    """
    return StaticOptimization(
        model,
        mechanism,
        external_loads=job.find_path("external_loads_file"),
        folder=job.require_path("model_file").parent,
        early_return=True,
        **options,
    )


def satisfy_constraints(
    recorded: RecordedMotion, speeds: Array, simulation: Simulation, model: Model
) -> tuple[Array, Array]:
    """Return values and speeds of a motion that satisfy the constraints.

    Speeds change only in models without constraints in the constraint set, as in OpenSim.

    Args:
        recorded: motion whose values are to satisfy the constraints.
        speeds: generalized speeds (t, n).
        simulation: simulation of the model.
        model: model of the simulation.

    Returns:
        Values (t, n) and speeds (t, n).
    """
    if not simulation.constraints:
        return recorded.values, speeds
    recorded = recorded.assemble_poses()
    if not model.constraint_set.objects:
        # OpenSim projects the speeds only in this case.
        moments = [*zip(recorded.times.tolist(), recorded.values, speeds, strict=True)]
        speeds = np.array(
            [
                recorded.mechanism.project_speeds(q, u, time)
                for time, q, u in watch_items("fulfilling the constraints", moments)
            ]
        )
    return recorded.values, speeds


class StateRows(NamedTuple):
    """States of a model in a file."""

    table: StoTable  # table of the file
    columns: dict[str, int]  # indices of columns by path of the state
    missing: tuple[str, ...]  # paths of states without a column

    @classmethod
    def read(cls, job: Job, path: Path, simulation: Simulation) -> StateRows:
        """Return the states in a file that are states of the model of a simulation.

        Args:
            job: setup of the tool, with the paths of its files.
            path: file of the states.
            simulation: simulation of the model.

        Raises:
            DocumentError: the file has no states of the model, or no rows, or is in degrees.
        """
        table = read_sto(path)
        columns = match_state_columns(table.columns, simulation.paths)
        if table.in_degrees:
            raise job.create_error(
                f"OpenSim rejects states in degrees; convert '{path}' to radians"
            )
        if not columns or not len(table.times):
            raise job.create_error(
                f"'{path}' has no {'rows' if columns else 'column with a state of the model'}"
            )
        return cls(table, columns, tuple(path for path in simulation.paths if path not in columns))

    def find_row(self, time: float) -> int:
        """Return the number of the last row up to a time in s; 0 before the first row."""
        return max(0, int(np.searchsorted(self.table.times, time, side="right")) - 1)

    def create_state(self, simulation: Simulation, row: int) -> list[float]:
        """Return the state of a row in the order of the engine.

        Missing columns have default values.

        Args:
            simulation: simulation of the model.
            row: number of the row.
        """
        values_by_path = {
            path: float(self.table.rows[row, index]) for path, index in self.columns.items()
        }
        auxiliary = [path for path in simulation.state.paths if path in values_by_path]
        values_of_coordinates = {
            path: value for path, value in values_by_path.items() if path not in auxiliary
        }
        q, u, _ = resolve_initial_values(simulation.mechanism, values_of_coordinates, {})
        if simulation.constraints:
            q = simulation.mechanism.assemble(q, float(self.table.times[row])).tolist()
        y = simulation.state.pack(q, u)
        first_auxiliary = 2 * len(simulation.state.order)
        for path in auxiliary:
            y[first_auxiliary + simulation.state.paths.index(path)] = values_by_path[path]
        return y

    def read_speeds(self, simulation: Simulation) -> Array:
        """Return the generalized speeds of all rows (t, n); missing columns are 0."""
        result = np.zeros((len(self.table.times), len(simulation.mechanism.coordinates)))
        for index, info in enumerate(simulation.mechanism.coordinates):
            if (column := self.columns.get(f"{info.path}/speed")) is not None:
                result[:, index] = self.table.rows[:, column]
        return result

    def report_missing(self, outcome: Outcome) -> None:
        """Add a message about states without a column."""
        if self.missing:
            outcome.add_message(
                "not in the file", f"{join_words(self.missing)}: the default values are used"
            )


def report_rows(job: Job, outcome: Outcome, motion: Motion) -> None:
    """Add a message about the number of rows, and the motion for a report.

    Args:
        job: setup of the tool, with the paths of its files.
        outcome: outcome to which the message is added.
        motion: motion with all rows.
    """
    times = motion.times
    outcome.evidence = Evidence.from_values(
        motion.model,
        job.require_path("model_file"),
        motion.mechanism,
        times,
        motion.values,
        loads=job.find_path("external_loads_file"),
    )
    outcome.add_message("rows", f"{len(times)}, from {times[0]:g} s to {times[-1]:g} s")
    outcome.summary["rows"] = len(times)
