"""The models of a sweep: those that a sample's properties and parameters make of the given one.

A model is made afresh for each new set of numbers. For the compiled engine, only that is made which
the numbers have a part in, where they belong to forces, are masses, mass centres or inertias of
bodies, or gravity. The numbers are those of a model that is built from a file either way, since the
same functions make them.
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
from osimlite.schema.actuators import Actuator
from osimlite.schema.base import Component
from osimlite.schema.forces import Force
from osimlite.schema.frames import Body
from osimlite.schema.model import Model
from osimlite.schema.sets import Controller
from osimlite.simulation.batches import ModelUpdater
from osimlite.simulation.run import Simulation
from osimlite.simulation.states import StateLayout
from osimlite.studies.sweep.controls import Control, VariedControls, controller_of
from osimlite.studies.sweep.plan import Plan
from osimlite.studies.sweep.registry import start_named
from osimlite.studies.sweep.variables import Floats, Gains, Parameter, Property, Slope, Start

if TYPE_CHECKING:
    from osimlite.simulation.control_steps import Controller as Feedback
    from osimlite.simulation.control_steps import KernelController

RENEWED = Force, Controller, Body, Model
"""What an engine need not be made anew for."""

MOST_KEPT = 64
"""So many models are kept: a grid asks for the same ones again and again."""


@dataclass
class Variant:
    """A model made ready."""

    state: StateLayout  # what its states consist of
    structure: bytes  # equal for variants that differ in numbers only
    numbers: Floats  # all numbers of an engine that computes batches, empty for others
    maker: Callable[[], Any]  # makes its engine
    simulation: Simulation | None = None  # that the engine is part of; None if only forces are new
    controller: Feedback | None = None
    held: KernelController | None = None  # of it

    @cached_property
    def engine(self) -> Any:
        """The engine of this very model."""
        return self.maker()


class Variants:
    """Makes the models of a plan; for one thread.

    Args:
        plan: whose.

    Attributes:
        model: with the numbers of the variant that was made last.

    Raises:
        OsimliteError: the model cannot be simulated as it is given.
    """

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        targets = [item.target for item in plan.variables]
        starts = [
            (k, part)
            for k, target in enumerate(targets)
            if isinstance(target, Start)
            for part in target.parts
        ]
        self._starts = [(k, part.coordinates[0], part.is_speed) for k, part in starts]
        self._changes = [k for k, target in enumerate(targets) if not isinstance(target, Start)]
        self._gains = [k for k, target in enumerate(targets) if isinstance(target, Gains)]
        self._controller = plan.controller
        self._parameters = [k for k, target in enumerate(targets) if isinstance(target, Parameter)]
        self._adopt(plan.model())
        self.given = self._whole()
        if plan.is_planted:
            # A model without two feet is told of before any run.
            start_named("planted")(self.given.engine, plan.feet)
        self._kept: dict[tuple[float, ...], Variant | OsimliteError] = {}
        self._renewal: ModelUpdater | None = None

    @property
    def is_fixed(self) -> bool:
        """Whether there is one model only."""
        return not self._changes

    def variant(self, values: Sequence[float]) -> Variant:
        """The model of a sample.

        Raises:
            OsimliteError: there is none with these numbers.
        """
        if not self._changes:
            return self.given
        key = tuple(values[place] for place in self._changes)
        result = self._kept.get(key)
        if result is None:
            try:
                result = self._make(values)
            except OsimliteError as error:
                result = error
            if len(self._kept) >= MOST_KEPT:
                self._kept = {}
            self._kept[key] = result
        if isinstance(result, OsimliteError):
            raise result
        return result

    def start(self, variant: Variant, values: Sequence[float]) -> Floats:
        """Initial state of a sample (y,).

        Raises:
            OsimliteError: the model has no such coordinate, or holds it, or a muscle has no
                equilibrium.
        """
        # An engine of its own is only made where the coordinates may be others.
        engine = (self.given if variant.structure == self.given.structure else variant).engine
        row = np.array(variant.state.pack_defaults())
        simulation = variant.simulation or self.given.simulation
        if simulation is not None and simulation.constraints:
            # The rest follows from what is set.
            chosen: tuple[dict[str, float], dict[str, float]] = {}, {}
            for place, path, is_speed in self._starts:
                chosen[is_speed][path] = float(values[place])
            row = np.array(simulation.initial_state(*chosen))
        else:
            for place, path, is_speed in self._starts:
                coordinate = engine.mechanism.coordinate_index(path)
                if coordinate not in engine.order:
                    raise SettingError(f"'{path}' is locked in this model, so that it has no start")
                number = engine.order.index(coordinate)
                row[number + (len(engine.order) if is_speed else 0)] = values[place]
        return self.prepare_states(engine, [variant], row[None])[0]

    def prepare_states(self, engine: Any, variants: Sequence[Variant], states: Floats) -> Floats:
        """States (k, y) of as many models, with the auxiliary ones where they start from the values and speeds.

        Args:
            engine: of any model of the structure that these have.
            variants: the models (k).
            states: what values and speeds are taken of (k, y).

        Raises:
            SimulationError: they are to start in equilibrium, and a muscle has none.
        """
        rows = np.concatenate(
            [
                variant.state.restart_auxiliary(row[None])
                for variant, row in zip(variants, states, strict=True)
            ]
        )
        if self._plan.equilibrate:
            for row, variant in zip(rows, variants, strict=True):
                # An engine of its own is only made where it must be, and to tell why there is no
                # equilibrium.
                y, result = row.tolist(), None
                if len(variant.numbers):
                    with suppress(SimulationError):
                        result = engine.equilibrate_muscles(0.0, y, variant.numbers)
                row[:] = variant.engine.equilibrate_muscles(0.0, y) if result is None else result
        return rows

    def place_states(self, engine: Any, variants: Sequence[Variant], starts: Floats) -> Floats:
        """Initial states (k, y), put on their feet if the plan says so.

        Args:
            engine: of any model of the structure that these have.
            variants: the models (k).
            starts: where they start (k, y).

        Raises:
            OsimliteError: the model has no two feet.
        """
        if not self._plan.is_planted:
            return starts
        place = start_named("planted")(engine, self._plan.feet)
        numbers = None if self.is_fixed else np.stack([variant.numbers for variant in variants])
        return place(starts, numbers, lambda states: self.prepare_states(engine, variants, states))

    def present(self) -> list[float | None]:
        """The values of the variables in the model as it is given; None where nothing tells it."""
        result: list[float | None] = []
        engine = self.given.engine
        setters = dict(self._setters)
        for index, item in enumerate(self._plan.variables):
            if isinstance(item.target, Start):
                info = engine.mechanism.coordinates[
                    engine.mechanism.coordinate_index(item.target.coordinates[0])
                ]
                result.append(info.default_speed if item.target.is_speed else info.default_value)
            elif isinstance(item.target, Property):
                result.append(1.0 if item.target.is_scaled else setters[index][0].get_value())
            elif isinstance(item.target, Control | Gains):
                result.append(item.target.present)
            else:
                result.append(item.target.default if isinstance(item.target, Parameter) else 0.0)
        return result

    def set_start(self, values: Sequence[float]) -> None:
        """Make the initial state of a sample the default state of `model`."""
        coordinates: Any = self.model.tree().by_path
        for place, path, is_speed in self._starts:
            setattr(
                coordinates[path],
                "default_speed_value" if is_speed else "default_value",
                float(values[place]),
            )
        if self._plan.is_planted:
            variant = self.variant(values)
            engine = variant.engine
            (row,) = self.place_states(
                engine, [variant], self.start(variant, values)[None]
            ).tolist()
            for number, place in enumerate(engine.order):
                coordinate = coordinates[engine.mechanism.coordinates[place].path]
                coordinate.default_value, coordinate.default_speed_value = (
                    row[number],
                    row[number + len(engine.order)],
                )

    def controller(self, values: Sequence[float]) -> Feedback:
        """That of a sample."""
        assert self._plan.controller is not None
        variables = self._plan.variables
        parts = (
            (name, values[k])
            for k in self._gains
            for name in getattr(variables[k].target, "parts", ())
        )
        return self._plan.controller.with_values({name: float(value) for name, value in parts})

    def build_model(self, values: Sequence[float]) -> Model:
        """The model of a sample, as others are to have it."""
        self.apply_sample(values)
        self.set_start(values)
        if self._plan.controller is not None:
            self.model.remove(self._open)
        return self.model

    def apply_sample(self, values: Sequence[float]) -> None:
        """Make `model` that of a sample, but for its initial state.

        Raises:
            OsimliteError: it does not take the numbers.
        """
        if self._parameters:
            assert self._plan.make is not None
            names = {
                self._plan.variables[place].name: float(values[place]) for place in self._parameters
            }
            self._adopt(self._plan.make(names))
        if self._gains:
            self._controller = self.controller(values)
        for place, setters in self._setters:
            for setter in setters:
                setter.set_value(float(values[place]))
        self._controls.apply(values)
        for place in self._slopes:
            angle, g = float(values[place]), self._gravity
            self.model.gravity = (g * math.sin(angle), -g * math.cos(angle), self.model.gravity[2])

    # ------------------------------------------------------------------------------------------------ helpers
    def _adopt(self, model: Model) -> None:
        self.model = model
        self._gravity = math.hypot(*model.gravity[:2])
        self._slopes, self._setters = [], []
        owners: list[Component] = []
        for place in self._changes:
            target = self._plan.variables[place].target
            if isinstance(target, Property):
                setters = [item.make_setter(model) for item in target.places]
                self._setters.append(
                    (place, [item.as_factor() for item in setters] if target.is_scaled else setters)
                )
                owners += [model.tree().by_path[item.component] for item in target.places]
            elif isinstance(target, Slope):
                self._slopes.append(place)
                owners.append(model)
        targets = ((place, self._plan.variables[place].target) for place in self._changes)
        controls = {place: target for place, target in targets if isinstance(target, Control)}
        self._controls = VariedControls(model, controls, self._plan.interpolation)
        owners += self._controls.controllers
        if self._plan.controller is not None:
            # To which what it says is added, behind all else.
            self._open = model.add(
                controller_of(model, {item.path: 0.0 for item in model.components(Actuator)})
            )
        can_renew = self._plan.engine == "compiled" and not self._parameters
        self._owners = (
            owners if can_renew and all(isinstance(item, RENEWED) for item in owners) else None
        )

    def _whole(self) -> Variant:
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
        kind = (*(info.path for info in infos), *engine.order, *engine.contacts)
        structure = repr(kind).encode() + getattr(engine, "structure", np.zeros(0)).tobytes()
        numbers = getattr(engine, "numbers", np.zeros(0))
        return self._add_controls(
            Variant(simulation.state, structure, numbers, lambda: engine, simulation)
        )

    def _add_controls(self, variant: Variant) -> Variant:
        if self._controller is not None:
            variant.controller, variant.held = (
                self._controller,
                self._controller.compile_for(self.model, variant.engine),
            )
        return variant

    def _make(self, values: Sequence[float]) -> Variant:
        self.apply_sample(values)
        given = self.given
        if self._changes == self._gains:
            return self._add_controls(replace(given))
        if self._owners is None:
            return self._whole()
        if self._renewal is None:
            self._renewal = given.engine.make_updater(
                self.model, Path(self._plan.folder or "."), self._plan.wrapping
            )
        made = self._renewal.update(self._owners)
        if made is None:
            return self._whole()
        # The auxiliary states may start otherwise.
        state = StateLayout(made.mechanism, given.state.order, made.forces.elements)
        return self._add_controls(Variant(state, given.structure, made.numbers, made.make_engine))
