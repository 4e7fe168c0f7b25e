"""Reflexes that drive the actuators of any simulation."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

import numpy as np

from osimlite.base.text import join_words, suggest_or_list
from osimlite.errors import SettingError
from osimlite.mechanics.kernels.reflexes import LIMITS, TERM
from osimlite.mechanics.kernels.sensors import SENSED
from osimlite.schema.model import Model
from osimlite.simulation.control_steps import Gain, KernelController
from osimlite.studies.reflexes.controllers import CONTROLLERS, Reflexes
from osimlite.studies.reflexes.parameters import AUTO, Parameter, Parameters, par_line, read_par
from osimlite.studies.reflexes.scenario import (
    OPTIMIZERS,
    control_step,
    legs_of,
    read_initial_parameters,
)
from osimlite.studies.reflexes.settings import Node, read_settings, settings_of
from osimlite.studies.reflexes.walkers import Felt


class Feedback:
    """A controller for ``osimlite.simulate(model, controller=Feedback("hold.yaml"))``.

    It computes the controls of the actuators that its reflexes name at every control step, and
    holds them between; what else drives these adds to it.

    Args:
        given: file with a ReflexController, GaitStateController, FeedForwardController or
            CompositeController, alone or in a scenario: SCONE's or YAML; or the same as data of
            Python. Beside one that stands alone there may be an `init`, and
            `fixed_control_step_size` and what legs are called, which a scenario has in its
            ModelOpenSim4.
        values: of its parameters, or a file of them (.par); others stand for the best that `init`
            has, or their means.

    Attributes:
        step: for which controls are held, s.

    Raises:
        DocumentError: it has something that is not done here; its name and line are told.
    """

    def __init__(
        self,
        given: str | Path | Mapping[str, Any],
        values: Mapping[str, float] | str | Path = MappingProxyType({}),
    ) -> None:
        if isinstance(given, Mapping):
            self._told, top, folder = "data of Python", settings_of(given), Path()
        else:
            self._told, top, folder = str(given), read_settings(given), Path(given).parent
        optimizer = next((node for _, node in top.all_of(*OPTIMIZERS)), top)
        objective = optimizer.get("SimulationObjective")
        holder, model = top, top
        if objective is not None:
            holder, model = objective, objective.get("ModelOpenSim4") or Node()
        found = holder.one_of(*CONTROLLERS)
        if found is None:
            raise holder.error(f"a controller is needed: {join_words(list(CONTROLLERS))}")
        self._kind, self._node = found
        self.step, self._legs = control_step(model), legs_of(model)
        known = {
            name: best for name, (best, _, _) in read_initial_parameters(optimizer, folder).items()
        }
        if isinstance(values, str | Path):
            values = {name: best for name, (best, _, _) in read_par(values).items()}
        self._begun, self._values = known, {**known, **values}
        if objective is None:
            top.expect_all_asked("a file of a controller")

    def __str__(self) -> str:
        return self._told

    @property
    def digest(self) -> str:
        """Of all that it is."""
        told = self._kind, self._node, self.step, self._legs, self._values
        return sha256(repr(told).encode()).hexdigest()

    def gains(self, model: Model, engine: Any) -> list[Gain]:
        """The parameters, for a model with its engine."""
        _, _, parameters = self._read(model, engine)
        found, values = parameters.found.values(), self._values
        return [
            Gain(each.name, values.get(each.name, each.mean), each.low, each.high) for each in found
        ]

    def with_values(self, values: Mapping[str, float]) -> Self:
        """The same with other values of some parameters."""
        result = copy(self)
        result._values = {**self._values, **values}
        return result

    def par(self) -> str:
        """The values of parameters that are given, as a file (.par)."""
        return "".join(
            par_line(Parameter(name, x, AUTO * abs(x), 0.0, 0.0), x)
            for name, x in self._values.items()
        )

    def _read(self, model: Model, engine: Any) -> tuple[Felt, Reflexes, Parameters]:
        felt, parameters = Felt(model, engine, 1, self.step, self._legs), Parameters(self._values)
        reflexes = Reflexes(self._node, self._kind, felt, parameters)
        for name in self._values:
            if name not in parameters.found and name not in self._begun:
                raise SettingError(
                    f"the controller has no parameter '{name}'{suggest_or_list(name, parameters.found)}"
                )
        return felt, reflexes, parameters

    def compile_for(self, model: Model, engine: Any) -> KernelController:
        """What the kernels go by, for a model with its engine.

        Raises:
            OsimliteError: the model has not what a reflex names, or a value belongs to no
                parameter.
        """
        felt, reflexes, parameters = self._read(model, engine)
        plan, numbers = reflexes.pack()
        # What no reflex names, and no noise, is left to others.
        everything, is_noisy = np.arange(len(felt.names)), numbers[0, LIMITS.CONTROL_NOISE] > 0.0
        targets = [term.ints[TERM.TARGET] for term in reflexes.terms]
        others = np.setdiff1d(everything, everything if is_noisy else targets)
        first, known = SENSED.HEAD + 2 * len(felt.muscles), felt.known.copy()
        known[first + others] = known[first + len(felt.names) + others] = 0.0
        return KernelController(
            tuple(felt.paths),
            self.step,
            tuple(source.name for source in reflexes.sources),
            felt.senses,
            known,
            plan,
            numbers,
            parameters.told,
        )
