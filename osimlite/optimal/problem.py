"""Optimal control problem of a Moco study."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.records import replace
from osimlite.derivatives.functions import CasadiModel
from osimlite.derivatives.symbols import postpone_interrupts
from osimlite.errors import SettingError
from osimlite.fitting.modifying.operators import process_model
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.multibody.spatial import Array
from osimlite.optimal.bounds import (
    UNBOUNDED,
    Range,
    compute_scaling,
    find_control_bounds,
    find_state_bounds,
    read_range,
)
from osimlite.optimal.dynamics import Dynamics
from osimlite.optimal.goals import GOAL_BUILDERS
from osimlite.optimal.layout import PROJECTION_SUFFIX, number_equations
from osimlite.optimal.path_constraints import PATH_CONSTRAINT_BUILDERS
from osimlite.optimal.point import (
    ConstraintRows,
    GoalTerms,
    TimeFunction,
    compute_projection_distance,
    make_integral_terms,
    sum_scaled_squares,
)
from osimlite.optimal.prescribed_motion import (
    Motion,
    PrescribedDynamics,
    PrescribedMotion,
    read_position_motion,
)
from osimlite.optimal.schemes import Grid, make_scheme
from osimlite.optimal.study_context import MAX_MESH_INTERVALS, MAX_MESH_VALUES, StudyContext
from osimlite.optimal.tables import sample_function
from osimlite.schema.base import Component, Object
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.moco.goals import MocoControlGoal, MocoGoal
from osimlite.schema.moco.parts import MocoParameter, MocoWeightSet
from osimlite.schema.moco.path_constraints import MocoPathConstraint
from osimlite.schema.moco.studies import MocoCasADiSolver, MocoStudy
from osimlite.schema.model import Model
from osimlite.schema.motions import PositionMotion
from osimlite.schema.sets import Controller

JOINTS_WITHOUT_RATES = "BallJoint", "EllipsoidJoint", "FreeJoint", "ScapulothoracicJoint"
"""Joints whose speeds are not the rates of their coordinates; Moco refuses them."""


class Problem(StudyContext):
    """Variables with their bounds, goals and constraints of a study.

    Args:
        study: study.
        file: file of the study, for messages and for the files that it names; None for a study that
            was not read from a file.
        folder: folder of the files that a study without a file names; the current folder if None.
        tables: tables by goal name that replace the files of the goals' references; None to read
            these files.
        motion: prescribed motion, as if the model had a PositionMotion; None for that of the model,
            if any.
        scaled: column of the reference that each scale factor multiplies, by the factor's name.

    Attributes:
        study: study; `phase` and `solver` are its parts.
        tables: tables by goal name that replace the files of the goals' references.
        model: model after the model processor.
        components: components of the model by path.
        functions: CasADi functions of the model
            (:class:`~osimlite.derivatives.functions.CasadiModel`), or of the model along a
            prescribed motion.
        states: bounds by path of the state, in the order of `functions.states`.
        controls: bounds by path of the control of each actuator that acts; the controls of others
            are zero.
        times: ranges of the initial and the final time, s.
        parameters: ranges by name of the parameter.
        parameter_owners: index of the parameter that stands for each of `functions.parameters`.
        constraint_names: names of the equations of the model's constraints, as OpenSim numbers
            them.
        grid: points of the motion.
        dynamics: equations of motion at a point.
        goals: enabled goals with their terms.
        path_rows: rows of the path constraints.
        loads: functions of time of the model's forces (`functions.loads`).
        time_functions: functions of time that formulas contain, in the order in which they were
            added.
        formulas: formulas of points that programs on several meshes share.

    Raises:
        UnsupportedError: the study contains something that is not supported here.
        DocumentError: the study is invalid, for example names a state that does not exist.
    """

    @postpone_interrupts()
    def __init__(
        self,
        study: MocoStudy,
        file: str | Path | None = None,
        folder: Path | None = None,
        tables: Mapping[str, StoTable] | None = None,
        motion: Motion | None = None,
        scaled: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(file, folder)
        self.tables = tables or {}
        self._scaled = scaled or {}
        self._factors: dict[str, str] = {}
        self.study = study
        # Invalid values are reported with their line, before a conversion could fail on them.
        self.check_values(study)
        self.phase = study.problem.phases
        self.time_functions: list[TimeFunction] = []
        # Formulas that programs on other meshes share; the key says whether they are for mesh points,
        # and whether for points with projected states.
        self.formulas: dict[tuple[bool, bool], Any] = {}
        if not isinstance(study.solver, MocoCasADiSolver):
            raise self.make_unsupported_error(study.solver, "only MocoCasADiSolver is supported")
        self.solver: MocoCasADiSolver = study.solver
        self.model = self._process_model()
        # A PositionMotion makes the coordinates functions of time, so that only actuators vary.
        motion = motion or self._remove_motion()
        self.components = {
            component.path: component
            for component in self.model.walk()
            if isinstance(component, Component)
        }
        self._check_components()
        self.loads: list[TimeFunction] = []
        paths = {
            parameter.name: self.list_parameter_paths(parameter)
            for parameter in self.phase.parameters
        }
        self.functions: Any = self._make_functions(
            [path for property_paths in paths.values() for path in property_paths], motion
        )
        # With a prescribed motion, muscles without activation dynamics leave no states.
        if motion is None and not self.functions.states:
            raise self.invalid_error(self.phase, "the model has no states")
        self.parameters: dict[str, Range] = {
            parameter.name: read_range(parameter.moco_bounds) or UNBOUNDED
            for parameter in self.phase.parameters
        }
        # A parameter may stand for several equal numbers of the model.
        self.parameter_owners = [
            index for index, property_paths in enumerate(paths.values()) for _ in property_paths
        ]
        self._add_scale_factors()
        # OpenSim has no controls of actuators that do not act.
        active_controls = [name for name in self.functions.controls if self._is_acting(name)]
        self._check_infos(active_controls)
        self.controls = find_control_bounds(self.phase, active_controls, self.components)
        self.states = find_state_bounds(
            self.phase, self.functions.states, self.components, self.controls
        )
        self.times = self._read_times()
        self.constraint_names = self._name_constraints()
        self.grid = Grid.from_mesh(make_scheme(self.solver.transcription_scheme), self._make_mesh())
        self.dynamics = Dynamics(self) if motion is None else PrescribedDynamics(self)
        self._check_settings()
        # Goals and constraints are built last, as they need states, controls and dynamics.
        self.goals: list[tuple[MocoGoal, GoalTerms]] = [
            *((goal, self._build_terms(goal)) for goal in self.phase.goals if goal.enabled),
            *self._make_solver_costs(),
        ]
        self.path_rows = [*map(self._build_rows, self.phase.path_constraints)]

    # --------------------------------------------------------------------------------------- for goals and tools
    def find_weights(
        self,
        owner: Object,
        by_name: MocoWeightSet,
        by_pattern: MocoWeightSet | None,
        names: Sequence[str],
        noun: str,
    ) -> list[float]:
        """Find the weights of names: by name, else by the last pattern that matches, else 1.

        Args:
            owner: goal, for messages.
            by_name: weights by name.
            by_pattern: weights by pattern; None if the goal has no such property.
            names: names that need a weight.
            noun: noun for the named things, such as "state", for messages.

        Returns:
            Weight of each name.

        Raises:
            DocumentError: a weight is for an unknown name.
        """
        weight_by_name = {weight.name: weight.weight for weight in by_name.objects}
        for name in weight_by_name:
            self.check_name(owner, name, names, noun)
        result = dict.fromkeys(names, 1.0)
        for weight in by_pattern.objects if by_pattern is not None else ():
            matches = self.compile_pattern(weight, weight.name)
            result |= {name: weight.weight for name in names if matches(name)}
        return [*(result | weight_by_name).values()]

    def add_time_function(self, values: Callable[[Array], Array], label: str = "") -> TimeFunction:
        """Add a function of time for formulas at points (``point.evaluate(function)``).

        Args:
            values: function of times (n,) that returns value, first and second derivative (3, n).
            label: name of the column, which a scale factor of the goal may multiply.

        Returns:
            Function of time with its index in `time_functions`.
        """
        factor = self._factors.get(label)
        series = TimeFunction(
            len(self.time_functions),
            values,
            None if factor is None else [*self.parameters].index(factor),
        )
        self.time_functions.append(series)
        return series

    def list_parameter_paths(self, parameter: MocoParameter) -> list[str]:
        """Return the paths of the numbers that a parameter stands for.

        Args:
            parameter: parameter of the study.

        Returns:
            Path of a component, its property and, for an element of a vector, the index:
            ``/bodyset/torso/mass``.

        Raises:
            DocumentError: the parameter names no component.
        """
        if not parameter.component_paths:
            raise self.invalid_error(parameter, "component_paths is required")
        element = parameter.property_element
        suffix = "" if element is None else f"/{element}"
        return [
            f"{str(path).rstrip('/')}/{parameter.property_name}{suffix}"
            for path in parameter.component_paths
        ]

    # ------------------------------------------------------------------------------------------------- parts
    def _process_model(self) -> Model:
        """Return the model after its processor."""
        processor = self.phase.model
        if not processor.filepath.strip() and processor.model is None:
            raise self.invalid_error(processor, "a model or a filepath is required")
        return process_model(processor, self.folder)

    def _read_times(self) -> tuple[Range, Range]:
        """Read the ranges of the initial and the final time.

        Returns:
            Range of the initial time, s, and of the final time, s.

        Raises:
            DocumentError: the motion cannot end after its start.
        """
        initial = read_range(self.phase.time_initial_bounds) or UNBOUNDED
        final = read_range(self.phase.time_final_bounds) or UNBOUNDED
        if final[1] <= initial[0]:
            raise self.invalid_error(
                self.phase.time_final_bounds,
                f"the latest final time, {final[1]:g} s, is not after the earliest initial time, "
                f"{initial[0]:g} s",
            )
        return initial, final

    def _remove_motion(self) -> Motion | None:
        """Remove an enabled PositionMotion from the model and return its motion, or None.

        Returns:
            The motion, or None if the model has no enabled PositionMotion.
        """
        for position_motion in list(self.model.components(PositionMotion)):
            if position_motion.default_enabled:
                path = position_motion.path
                motion = read_position_motion(position_motion, self.model)
                self.model.remove(position_motion)
                if isinstance(motion, str):
                    raise self.invalid_error(
                        self.phase, f"PositionMotion '{path}' has no function for '{motion}'"
                    )
                return motion
        return None

    def _make_functions(self, parameters: list[str], motion: Motion | None) -> Any:
        """Return the CasADi functions of the model, or of the model along a prescribed motion.

        Args:
            parameters: paths of the numbers that vary.
            motion: prescribed motion; None if the coordinates vary.
        """
        if motion is None:
            try:
                # Loads that depend on time only come as numbers (`functions.loads`): their splines
                # are costly as formulas.
                functions = CasadiModel(self.model, parameters, self.folder, loads_as_inputs=True)
            except SettingError as error:
                # The error of the model names a path; the parameter with this path is what the user
                # wrote.
                faulty_parameters = (
                    parameter
                    for parameter in self.phase.parameters
                    if any(
                        f"'{path}'" in error.message
                        for path in self.list_parameter_paths(parameter)
                    )
                )
                raise self.invalid_error(
                    next(faulty_parameters, self.phase), error.message
                ) from None
            self.loads = [
                self.add_time_function(partial(sample_function, load)) for load in functions.loads
            ]
            return functions
        if parameters:
            raise self.make_unsupported_error(
                self.phase,
                f"parameters ({parameters[0]}) are not supported with a prescribed motion",
            )
        return PrescribedMotion(self.model, motion, self.folder)

    def _check_components(self) -> None:
        """Check the model for locked coordinates, controllers and joints that Moco or osimlite refuses."""
        for component in self.components.values():
            if isinstance(component, Coordinate) and component.locked:
                raise self.invalid_error(
                    self.phase,
                    f"{component.path} is locked, which Moco rejects; use a WeldJoint instead",
                )
            if isinstance(component, Controller) and component.enabled:
                message = f"the model's {type(component).tag} '{component.path}' sets controls, which is not supported; remove it"
                raise self.make_unsupported_error(self.phase, message)
            if type(component).tag in JOINTS_WITHOUT_RATES:
                message = (
                    f"{type(component).tag} '{component.path}' has speeds other than the rates of its "
                    "coordinates, which Moco rejects"
                )
                raise self.invalid_error(self.phase, f"{message}; use a CustomJoint")

    def _check_settings(self) -> None:
        """Check that the study asks for a solver that is supported here."""
        if self.solver.optim_solver != "ipopt":
            raise self.make_unsupported_error(
                self.solver,
                f"optim_solver '{self.solver.optim_solver}' is not supported; use ipopt",
            )

    def _make_solver_costs(self) -> Iterator[tuple[MocoGoal, GoalTerms]]:
        """Yield the costs that settings of the solver add, named as in Moco.

        Yields:
            Goal with the name and the weight, and its terms.
        """
        solver = self.solver
        acceleration_count = len(self.functions.coordinates) if self.dynamics.is_implicit else 0
        if solver.minimize_lagrange_multipliers and not self.constraint_names:
            raise self.invalid_error(
                solver, "minimize_lagrange_multipliers requires a model with constraints"
            )
        for name, is_active, weight, selection, bounds in (
            (
                "multipliers",
                solver.minimize_lagrange_multipliers,
                solver.lagrange_multiplier_weight,
                "multipliers",
                self.phase.multiplier_bounds,
            ),
            (
                "accelerations",
                solver.minimize_implicit_multibody_accelerations and self.dynamics.is_implicit,
                solver.implicit_multibody_accelerations_weight,
                slice(None, acceleration_count),
                solver.implicit_multibody_acceleration_bounds,
            ),
            (
                "auxiliary_derivatives",
                solver.minimize_implicit_auxiliary_derivatives
                and bool(self.dynamics.tendons.names),
                solver.implicit_auxiliary_derivatives_weight,
                slice(acceleration_count, None),
                solver.implicit_auxiliary_derivative_bounds,
            ),
        ):
            if is_active:
                # Moco's costs are squares of the scaled variables.
                scaling = (
                    compute_scaling(*(read_range(bounds) or UNBOUNDED))
                    if solver.scale_variables_using_bounds
                    else (1.0, 0.0)
                )
                yield (
                    MocoControlGoal(name=name, weight=weight),
                    make_integral_terms(partial(sum_scaled_squares, selection, scaling)),
                )
        if solver.minimize_state_projection_distance and self.uses_projection:
            goal = MocoControlGoal(
                name="state_projection", weight=solver.state_projection_distance_weight
            )
            yield goal, replace(make_integral_terms(compute_projection_distance), is_sum=True)

    def _is_acting(self, control: str) -> bool:
        """Return whether the actuator of a control applies its force.

        Args:
            control: path of the actuator, with the suffix of the control if it has several.
        """
        actuator: Any = self.components.get(control) or self.components[control.rpartition("_")[0]]
        return bool(actuator.appliesForce)

    def _check_infos(self, controls: Sequence[str]) -> None:
        """Check the names and patterns of the study's entries for states and controls.

        Args:
            controls: paths of the controls that vary.
        """
        for pattern in (*self.phase.state_infos_pattern, *self.phase.control_infos_pattern):
            self.compile_pattern(pattern, pattern.name)
        for infos, known_names, variable_type in (
            (self.phase.state_infos, self.functions.states, "state"),
            (self.phase.control_infos, controls, "control"),
        ):
            for info in infos:
                self.check_name(info, info.name, known_names, variable_type)
        for info in (*self.phase.input_control_infos, *self.phase.input_control_infos_pattern):
            raise self.make_unsupported_error(info, "input controls are not supported")

    def _name_constraints(self) -> list[str]:
        """Name the equations of the model's constraints as OpenSim numbers them: constraint, then row.

        Returns:
            A name for each equation; none without constraints.
        """
        count = self.functions.constraint_count
        if not count:
            return []
        if not isinstance(self.functions, PrescribedMotion):
            self._check_constraint_method(count)
        # OpenSim counts the constraints that lock or prescribe coordinates first.
        coordinates = [
            coordinate
            for coordinate in self.components.values()
            if isinstance(coordinate, Coordinate)
        ]
        # Each coordinate has a lock, and one more constraint if it has a prescribed function.
        first_number = sum(
            1 + (coordinate.prescribed_function is not None) for coordinate in coordinates
        )
        return [
            f"cid{first_number + number}_p{row}"
            for number, row in number_equations(self.model, count)
        ]

    def _check_constraint_method(self, count: int) -> None:
        """Check the settings that keep states on the model's constraints.

        Args:
            count: number of equations of the constraints.
        """
        solver = self.solver
        if solver.kinematic_constraint_method == "Bordalba2023":
            if not solver.enforce_constraint_derivatives:
                raise self.invalid_error(
                    solver, "Bordalba2023 requires enforce_constraint_derivatives, as in Moco"
                )
        elif (
            solver.transcription_scheme != "hermite-simpson"
            and solver.enforce_constraint_derivatives
        ):
            message = "enforce_constraint_derivatives with Posa2016 requires transcription_scheme hermite-simpson, as in Moco"
            raise self.invalid_error(solver, message)
        if self.functions.constraints.size1_out(0) != count:
            raise self.make_unsupported_error(
                self.phase,
                "constraints that concern only speeds are not supported",
            )

    def _make_mesh(self) -> Array:
        """Return the ends of the mesh intervals, from 0 to 1."""
        solver = self.solver
        intervals = len(solver.mesh) or solver.num_mesh_intervals
        # Checked before anything is allocated, as a typing error would use up the memory.
        maximum = min(MAX_MESH_INTERVALS, MAX_MESH_VALUES // max(1, len(self.functions.states)))
        if intervals > maximum:
            message = f"the mesh has {intervals} intervals; the maximum for this model is {maximum}"
            raise self.invalid_error(solver, message)
        if not solver.mesh:
            return np.linspace(0.0, 1.0, solver.num_mesh_intervals + 1)
        mesh = np.array(solver.mesh)
        if mesh[0] != 0.0 or mesh[-1] != 1.0 or np.any(np.diff(mesh) <= 0.0):
            raise self.invalid_error(solver, "mesh must increase from 0 to 1")
        return mesh

    def _build_terms(self, goal: MocoGoal) -> GoalTerms:
        """Build the terms of a goal, and check its mode and its scale factors.

        Returns:
            The terms, as the builder of the class of goals makes them.
        """
        build = GOAL_BUILDERS.get(type(goal))
        if build is None:
            raise self.make_unsupported_error(goal, "this class of goals is not supported yet")
        self._factors = {self._scaled[factor.name]: factor.name for factor in goal.scale_factors}
        first_function = len(self.time_functions)
        terms = build(goal, self)
        used_factors = [
            time_function.factor for time_function in self.time_functions[first_function:]
        ]
        for factor in goal.scale_factors:
            if [*self.parameters].index(factor.name) not in used_factors:
                raise self.invalid_error(
                    factor, f"the goal tracks no column '{self._scaled[factor.name]}'"
                )
        self._factors = {}
        if goal.mode is not None and goal.mode not in terms.modes:
            raise self.invalid_error(
                goal, f"mode '{goal.mode}' is not possible, as in Moco; use {terms.modes[0]}"
            )
        return terms

    def _build_rows(self, constraint: MocoPathConstraint) -> ConstraintRows:
        """Return the rows of a path constraint."""
        build = PATH_CONSTRAINT_BUILDERS.get(type(constraint))
        if build is None:
            raise self.make_unsupported_error(
                constraint, "this class of path constraints is not supported yet"
            )
        return build(constraint, self)

    def _add_scale_factors(self) -> None:
        """Add the scale factors of goals to the parameters."""
        for factor in [factor for goal in self.phase.goals for factor in goal.scale_factors]:
            if factor.name not in self._scaled:
                # OpenSim's method addScaleFactor() receives the column, and its files do not store it.
                message = "a file does not store which column a scale factor scales, and OpenSim ignores scale factors in files"
                raise self.make_unsupported_error(
                    factor, f"{message}; in Python, pass `scaled` to osimlite.moco.solve"
                )
            if factor.name in self.parameters:
                raise self.invalid_error(factor, "another parameter has this name")
            self.parameters[factor.name] = read_range(factor) or UNBOUNDED

    @property
    def model_weight(self) -> float:
        """Return the weight of the model, N; its mass where there is no gravity, as in OpenSim."""
        mechanism = self.functions.mechanism
        return float(mechanism.total_mass * (float(np.linalg.norm(mechanism.gravity)) or 1.0))

    @property
    def has_constraints(self) -> bool:
        """Return whether the model's constraints are equations of the problem."""
        # A prescribed motion fulfils the constraints already; only their multipliers vary.
        return bool(self.constraint_names) and not isinstance(self.functions, PrescribedMotion)

    @property
    def uses_projection(self) -> bool:
        """Return whether states are projected onto the constraints at the ends of intervals (Bordalba et al.)."""
        return self.has_constraints and self.solver.kinematic_constraint_method == "Bordalba2023"

    @property
    def projected_names(self) -> list[str]:
        """Return the names of values and speeds before projection; empty without projection."""
        count = 2 * len(self.functions.coordinates) if self.uses_projection else 0
        return [f"{name}{PROJECTION_SUFFIX}" for name in self.functions.states[:count]]

    @cached_property
    def slack_names(self) -> list[str]:
        """Return the names of the slacks, as in Moco.

        They are the velocity corrections of the constraints, or with projection the corrections of
        values and speeds in turn; empty if the study has neither.
        """
        if self.uses_projection:
            return [f"mu_{name}{end}" for name in self.constraint_names for end in ("", "_dot")]
        is_corrected = self.has_constraints and self.solver.enforce_constraint_derivatives
        return [f"gamma_{name}" for name in self.constraint_names] if is_corrected else []
