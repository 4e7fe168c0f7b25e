"""Reflex controllers for any simulation, not only for scenarios of SCONE."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

import numpy as np

from osimlite.base.text import suggest_or_list
from osimlite.errors import SettingError
from osimlite.mechanics.kernels.reflexes import LIMITS, TERM
from osimlite.mechanics.kernels.sensors import SENSOR_NUMBERS
from osimlite.schema.model import Model
from osimlite.simulation.control_steps import Gain, KernelController
from osimlite.studies.reflexes.controllers import CONTROLLERS, Reflexes
from osimlite.studies.reflexes.parameters import (
    AUTO_STD_FACTOR,
    Parameter,
    Parameters,
    format_par_line,
    read_par,
)
from osimlite.studies.reflexes.scenario import (
    OPTIMIZERS,
    read_control_step,
    read_initial_parameters,
    read_leg_names,
)
from osimlite.studies.reflexes.settings import SettingNode, make_node, read_settings
from osimlite.studies.reflexes.walkers import SensedModel


class Feedback:
    """Reflex controller for `osimlite.simulate(model, controller=Feedback("hold.yaml"))`.

    It computes the controls of the actuators that its reflexes name at every control step, and
    holds them constant until the next. Controls of other sources add to them.

    Args:
        given: file of SCONE or YAML, or Python data, with a ReflexController, GaitStateController,
            FeedForwardController or CompositeController, alone or within a scenario. Beside a
            controller that stands alone there may be `init`, `fixed_control_step_size` and the
            names of the legs, which a scenario has in its ModelOpenSim4.
        values: values of parameters by name, or a .par file. Parameters without a value have the
            best value of `init`, or their mean.

    Attributes:
        step: duration of a control step (s).

    Raises:
        DocumentError: the file has something that is not supported; the error has its name and
            line.
    """

    def __init__(
        self,
        given: str | Path | Mapping[str, Any],
        values: Mapping[str, float] | str | Path = MappingProxyType({}),
    ) -> None:
        if isinstance(given, Mapping):
            self._source_text = "Python data"
            root_node = make_node(given)
            folder = Path()
        else:
            self._source_text = str(given)
            root_node = read_settings(given)
            folder = Path(given).parent
        # The controller may stand alone, in an objective, or in a complete scenario.
        optimizer = next((node for _, node in root_node.select_all(*OPTIMIZERS)), root_node)
        objective = optimizer.get("SimulationObjective")
        controller_parent, model = root_node, root_node
        if objective is not None:
            controller_parent = objective
            model = objective.get("ModelOpenSim4") or SettingNode()
        self._class_name, self._node = controller_parent.require_one("controller", CONTROLLERS)
        self.step = read_control_step(model)
        self._legs = read_leg_names(model)
        initial_values = {
            name: best for name, (best, _, _) in read_initial_parameters(optimizer, folder).items()
        }
        if isinstance(values, str | Path):
            values = {name: best for name, (best, _, _) in read_par(values).items()}
        # Values of the user override those of `init`.
        self._initial = initial_values
        self._values = {**initial_values, **values}
        # Other parts of a scenario, such as measures, are not needed here and may remain unread.
        if objective is None:
            root_node.refuse_unread_parts("a file of a controller")

    def __str__(self) -> str:
        return self._source_text

    @property
    def digest(self) -> str:
        """SHA-256 digest of everything that determines the controls, as a key of caches."""
        content = self._class_name, self._node, self.step, self._legs, self._values
        return sha256(repr(content).encode()).hexdigest()

    def gains(self, model: Model, engine: Any) -> list[Gain]:
        """Return the parameters with their values and bounds.

        Args:
            model: model that the controller will drive.
            engine: engine of the model.
        """
        _, _, parameters = self._read_controller(model, engine)
        requested = parameters.requested.values()
        values = self._values
        return [
            Gain(
                parameter.name,
                values.get(parameter.name, parameter.mean),
                parameter.low,
                parameter.high,
            )
            for parameter in requested
        ]

    def replace_values(self, values: Mapping[str, float]) -> Self:
        """Return a copy in which some parameters have other values."""
        result = copy(self)
        result._values = {**self._values, **values}
        return result

    def par(self) -> str:
        """Return the values that are set, as text of a .par file."""
        return "".join(
            format_par_line(Parameter(name, x, AUTO_STD_FACTOR * abs(x), 0.0, 0.0), x)
            for name, x in self._values.items()
        )

    def _read_controller(
        self, model: Model, engine: Any
    ) -> tuple[SensedModel, Reflexes, Parameters]:
        """Read the controller for a model.

        Returns:
            Model with its sensors, reflexes of the controller, and parameters that the reflexes
            use.

        Raises:
            SettingError: a value belongs to no parameter of the controller.
        """
        sensed_model = SensedModel(model, engine, 1, self.step, self._legs)
        parameters = Parameters(self._values)
        reflexes = Reflexes(self._node, self._class_name, sensed_model, parameters)
        for name in self._values:
            # The file of `init` may have more parameters than the controller uses.
            if name not in parameters.requested and name not in self._initial:
                raise SettingError(
                    f"the controller has no parameter '{name}'{suggest_or_list(name, parameters.requested)}"
                )
        return sensed_model, reflexes, parameters

    def compile_for(self, model: Model, engine: Any) -> KernelController:
        """Return the controller as the kernels take it.

        Args:
            model: model that the controller will drive.
            engine: engine of the model.

        Raises:
            OsimliteError: the model lacks something that a reflex names, or a value belongs to no
                parameter.
        """
        sensed_model, reflexes, parameters = self._read_controller(model, engine)
        plan, numbers = reflexes.pack()
        # Controls without reflexes are left to other sources, unless there is base noise, which acts
        # on all controls. Proportional noise of a control that is 0 is 0.
        all_controls = np.arange(len(sensed_model.names))
        is_noisy = numbers[0, LIMITS.CONTROL_NOISE] > 0.0
        targets = [term.ints[TERM.TARGET] for term in reflexes.terms]
        unused_controls = np.setdiff1d(all_controls, all_controls if is_noisy else targets)
        # With bounds of 0 the kernels add nothing to a control.
        first_bound = SENSOR_NUMBERS.HEAD + 2 * len(sensed_model.muscles)
        sensor_numbers = sensed_model.sensor_numbers.copy()
        sensor_numbers[first_bound + unused_controls] = sensor_numbers[
            first_bound + len(sensed_model.names) + unused_controls
        ] = 0.0
        return KernelController(
            tuple(sensed_model.paths),
            self.step,
            tuple(source.name for source in reflexes.sources),
            sensed_model.sensor_plan,
            sensor_numbers,
            plan,
            numbers,
            parameters.values_used,
        )
