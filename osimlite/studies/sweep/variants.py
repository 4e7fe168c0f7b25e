"""Models of a sweep: the variants that samples make of the given model.

Each new set of numbers needs a new model. For the compiled engine, only the parts are updated that
depend on the numbers, if these belong to forces, to masses, mass centres or inertias of bodies, or
to gravity. The result is the same as that of a model built from a file, because the same functions
compute it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from osimlite.base.records import dataclass, replace
from osimlite.errors import OsimliteError, SettingError, SimulationError
from osimlite.schema.base import Component
from osimlite.schema.forces import Actuator, Force
from osimlite.schema.frames import Body
from osimlite.schema.model import Model
from osimlite.schema.sets import Controller
from osimlite.simulation.batches import ModelUpdater
from osimlite.simulation.run import Simulation
from osimlite.simulation.states import StateLayout
from osimlite.studies.sweep.controls import Control, VariedControls, make_controller
from osimlite.studies.sweep.plan import Plan
from osimlite.studies.sweep.registry import find_start
from osimlite.studies.sweep.variables import (
    Floats,
    FunctionParameter,
    Gains,
    Property,
    Slope,
    Start,
)

if TYPE_CHECKING:
    from osimlite.simulation.control_steps import Controller as Feedback
    from osimlite.simulation.control_steps import KernelController

UPDATABLE_TYPES = Force, Controller, Body, Model
"""Types of components whose numbers can change without a new engine."""

CACHED_VARIANTS = 64
"""Most variants in the cache: a grid requests the same ones repeatedly."""


@dataclass
class Variant:
    """Model of a sample, ready for simulation.

    Attributes:
        state: layout of the state of the model.
        structure: bytes that are equal for variants which differ in numbers only.
        numbers: numbers of the model for the compiled engine; empty for other engines.
        maker: function that makes the engine of the model.
        simulation: simulation of the engine; None if only numbers were updated.
        controller: feedback controller of the sample.
        kernel_controller: controller of the sample in the form of the kernels.
    """

    state: StateLayout
    structure: bytes
    numbers: Floats
    maker: Callable[[], Any]
    simulation: Simulation | None = None
    controller: Feedback | None = None
    kernel_controller: KernelController | None = None

    @cached_property
    def engine(self) -> Any:
        """Engine of this model, made at the first access."""
        return self.maker()


class Variants:
    """Maker of the models of a plan, for one thread.

    Args:
        plan: plan of the runs.

    Attributes:
        model: model with the numbers of the latest variant.
        base_variant: variant of the model with none of the variables set.

    Raises:
        OsimliteError: the model cannot be simulated.
    """

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        targets = [variable.target for variable in plan.variables]
        starts = [
            (k, single_start)
            for k, target in enumerate(targets)
            if isinstance(target, Start)
            for single_start in target.parts
        ]
        self._starts = [
            (k, single_start.coordinates[0], single_start.is_speed) for k, single_start in starts
        ]
        self._changes = [k for k, target in enumerate(targets) if not isinstance(target, Start)]
        self._gains = [k for k, target in enumerate(targets) if isinstance(target, Gains)]
        self._controller = plan.controller
        self._parameters = [
            k for k, target in enumerate(targets) if isinstance(target, FunctionParameter)
        ]
        self._set_model(plan.model())
        self.base_variant = self._make_complete_variant()
        if plan.is_planted:
            # A model without two feet fails here, before any run.
            find_start("planted")(self.base_variant.engine, plan.feet)
        self._cached_variants: dict[tuple[float, ...], Variant | OsimliteError] = {}
        self._renewal: ModelUpdater | None = None

    @property
    def is_fixed(self) -> bool:
        """True if all samples have the same model."""
        return not self._changes

    def make_variant(self, values: Sequence[float]) -> Variant:
        """Return the model of a sample from the cache, or make it.

        Raises:
            OsimliteError: the model is invalid with these values.
        """
        if not self._changes:
            return self.base_variant
        key = tuple(values[index] for index in self._changes)
        result = self._cached_variants.get(key)
        if result is None:
            try:
                result = self._make_variant(values)
            # Errors are cached, too: an invalid model would be built again for each sample.
            except OsimliteError as error:
                result = error
            if len(self._cached_variants) >= CACHED_VARIANTS:
                self._cached_variants = {}
            self._cached_variants[key] = result
        if isinstance(result, OsimliteError):
            raise result
        return result

    def make_start(self, variant: Variant, values: Sequence[float]) -> Floats:
        """Return the initial state of a sample (y,).

        Args:
            variant: model of the sample.
            values: values of all variables.

        Raises:
            SettingError: a coordinate is locked.
            OsimliteError: a coordinate is unknown, or a muscle has no equilibrium.
        """
        # A new engine is made only if the structure, and so the coordinates, may differ.
        engine = (
            self.base_variant if variant.structure == self.base_variant.structure else variant
        ).engine
        row = np.array(variant.state.pack_defaults())
        simulation = variant.simulation or self.base_variant.simulation
        if simulation is not None and simulation.constraints:
            # Assembly computes the dependent coordinates from those that are set.
            selected: tuple[dict[str, float], dict[str, float]] = {}, {}
            for index, path, is_speed in self._starts:
                selected[is_speed][path] = float(values[index])
            row = np.array(simulation.initial_state(*selected))
        else:
            for index, path, is_speed in self._starts:
                coordinate = engine.mechanism.coordinate_index(path)
                if coordinate not in engine.order:
                    raise SettingError(
                        f"'{path}' is locked in this model, so it has no initial value"
                    )
                number = engine.order.index(coordinate)
                row[number + (len(engine.order) if is_speed else 0)] = values[index]
        return self.prepare_states(engine, [variant], row[None])[0]

    def prepare_states(self, engine: Any, variants: Sequence[Variant], states: Floats) -> Floats:
        """Return states (k, y) with the start values of their auxiliary states.

        These follow from values and speeds.

        Args:
            engine: engine of any model of this structure.
            variants: models (k).
            states: states with values and speeds (k, y).

        Raises:
            SimulationError: the plan requests equilibrium, and a muscle has none.
        """
        rows = np.concatenate(
            [
                variant.state.restart_auxiliary(row[None])
                for variant, row in zip(variants, states, strict=True)
            ]
        )
        if self._plan.equilibrate:
            for row, variant in zip(rows, variants, strict=True):
                # A new engine is made only if the update fails, then also for its error message.
                values = row.tolist()
                result = None
                if len(variant.numbers):
                    with suppress(SimulationError):
                        result = engine.equilibrate_muscles(0.0, values, variant.numbers)
                row[:] = (
                    variant.engine.equilibrate_muscles(0.0, values) if result is None else result
                )
        return rows

    def make_initial_states(
        self, engine: Any, variants: Sequence[Variant], starts: Floats
    ) -> Floats:
        """Return initial states (k, y), with the feet on the ground if the plan requests it.

        Args:
            engine: engine of any model of this structure.
            variants: models (k).
            starts: initial states (k, y).

        Raises:
            OsimliteError: the model does not have two feet.
        """
        if not self._plan.is_planted:
            return starts
        plant_states = find_start("planted")(engine, self._plan.feet)
        numbers = None if self.is_fixed else np.stack([variant.numbers for variant in variants])
        return plant_states(
            starts, numbers, lambda states: self.prepare_states(engine, variants, states)
        )

    def list_current_values(self) -> list[float | None]:
        """Return the values of the variables in the given model; None where it has no value."""
        result: list[float | None] = []
        engine = self.base_variant.engine
        setters = dict(self._setters)
        for index, variable in enumerate(self._plan.variables):
            if isinstance(variable.target, Start):
                info = engine.mechanism.coordinates[
                    engine.mechanism.coordinate_index(variable.target.coordinates[0])
                ]
                result.append(
                    info.default_speed if variable.target.is_speed else info.default_value
                )
            elif isinstance(variable.target, Property):
                result.append(1.0 if variable.target.is_scaled else setters[index][0].get_value())
            elif isinstance(variable.target, Control | Gains):
                result.append(variable.target.current_value)
            else:
                result.append(
                    variable.target.default
                    if isinstance(variable.target, FunctionParameter)
                    else 0.0
                )
        return result

    def set_default_state(self, values: Sequence[float]) -> None:
        """Make the initial state of a sample the default state of `model`."""
        coordinates: Any = self.model.tree().by_path
        for index, path, is_speed in self._starts:
            setattr(
                coordinates[path],
                "default_speed_value" if is_speed else "default_value",
                float(values[index]),
            )
        if self._plan.is_planted:
            variant = self.make_variant(values)
            engine = variant.engine
            (row,) = self.make_initial_states(
                engine, [variant], self.make_start(variant, values)[None]
            ).tolist()
            for number, index in enumerate(engine.order):
                coordinate = coordinates[engine.mechanism.coordinates[index].path]
                coordinate.default_value = row[number]
                coordinate.default_speed_value = row[number + len(engine.order)]

    def make_controller(self, values: Sequence[float]) -> Feedback:
        """Return the controller with the gains of a sample."""
        assert self._plan.controller is not None
        variables = self._plan.variables
        named_values = (
            (name, values[k])
            for k in self._gains
            for name in getattr(variables[k].target, "parts", ())
        )
        return self._plan.controller.replace_values(
            {name: float(value) for name, value in named_values}
        )

    def build_model(self, values: Sequence[float]) -> Model:
        """Return the model of a sample for writing.

        It has the initial state of the sample, and no open control inputs.
        """
        self.apply_sample(values)
        self.set_default_state(values)
        if self._plan.controller is not None:
            self.model.remove(self._open)
        return self.model

    def apply_sample(self, values: Sequence[float]) -> None:
        """Set the numbers of `model` to those of a sample, except its initial state.

        Raises:
            OsimliteError: the model does not accept the values.
        """
        if self._parameters:
            assert self._plan.make is not None
            names = {
                self._plan.variables[index].name: float(values[index]) for index in self._parameters
            }
            self._set_model(self._plan.make(names))
        if self._gains:
            self._controller = self.make_controller(values)
        for index, setters in self._setters:
            for setter in setters:
                setter.set_value(float(values[index]))
        self._controls.apply(values)
        for index in self._slopes:
            angle = float(values[index])
            gravity = self._gravity
            # Tilting gravity about z is equivalent to a slope of the floor.
            self.model.gravity = (
                gravity * math.sin(angle),
                -gravity * math.cos(angle),
                self.model.gravity[2],
            )

    # ------------------------------------------------------------------------------------------------ helpers
    def _set_model(self, model: Model) -> None:
        """Set the model, and find the properties that variables change."""
        self.model = model
        self._gravity = math.hypot(*model.gravity[:2])
        self._slopes, self._setters = [], []
        changed_components: list[Component] = []
        for index in self._changes:
            target = self._plan.variables[index].target
            if isinstance(target, Property):
                setters = [element.make_setter(model) for element in target.paths]
                self._setters.append(
                    (
                        index,
                        [element.make_factor_setter() for element in setters]
                        if target.is_scaled
                        else setters,
                    )
                )
                changed_components += [
                    model.tree().by_path[element.component] for element in target.paths
                ]
            elif isinstance(target, Slope):
                self._slopes.append(index)
                changed_components.append(model)
        targets = ((index, self._plan.variables[index].target) for index in self._changes)
        controls = {index: target for index, target in targets if isinstance(target, Control)}
        self._controls = VariedControls(model, controls, self._plan.interpolation)
        changed_components += self._controls.controllers
        if self._plan.controller is not None:
            # The controller adds its controls to these constants of 0, after all other controllers.
            self._open = model.add(
                make_controller(
                    model, {element.path: 0.0 for element in model.components(Actuator)}
                )
            )
        # A function with other parameters may return any model.
        can_renew = self._plan.engine == "compiled" and not self._parameters
        self._owners = (
            changed_components
            if can_renew
            and all(isinstance(element, UPDATABLE_TYPES) for element in changed_components)
            else None
        )

    def _make_complete_variant(self) -> Variant:
        """Return a variant with a new simulation."""
        plan = self._plan
        simulation = Simulation(
            self.model,
            plan.engine,
            skip_unsupported=plan.skip_unsupported,
            wrapping=plan.wrapping,
            folder=plan.folder,
        )
        engine: Any = simulation.engine
        infos = engine.mechanism.coordinates
        structure_key = (*(info.path for info in infos), *engine.order, *engine.contacts)
        # Coordinates, their order in the state and contacts, besides the structure of the compiled
        # engine.
        structure = (
            repr(structure_key).encode() + getattr(engine, "structure", np.zeros(0)).tobytes()
        )
        numbers = getattr(engine, "numbers", np.zeros(0))
        return self._add_controls(
            Variant(simulation.state, structure, numbers, lambda: engine, simulation)
        )

    def _add_controls(self, variant: Variant) -> Variant:
        """Return a variant after compiling the controller for it, if there is one."""
        if self._controller is not None:
            variant.controller = self._controller
            variant.kernel_controller = self._controller.compile_for(self.model, variant.engine)
        return variant

    def _make_variant(self, values: Sequence[float]) -> Variant:
        """Return the model of a sample, by an update of the engine if possible."""
        self.apply_sample(values)
        base_variant = self.base_variant
        # Gains change the controller only; the engine stays.
        if self._changes == self._gains:
            return self._add_controls(replace(base_variant))
        if self._owners is None:
            return self._make_complete_variant()
        if self._renewal is None:
            self._renewal = base_variant.engine.make_updater(
                self.model, Path(self._plan.folder or "."), self._plan.wrapping
            )
        updated = self._renewal.update(self._owners)
        # The numbers change the structure, which needs a new engine.
        if updated is None:
            return self._make_complete_variant()
        # The start values of auxiliary states may depend on the numbers.
        state = StateLayout(updated.mechanism, base_variant.state.order, updated.forces.elements)
        return self._add_controls(
            Variant(state, base_variant.structure, updated.numbers, updated.make_engine)
        )
