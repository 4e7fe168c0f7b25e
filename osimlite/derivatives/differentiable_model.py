"""Packed model with the names of its states, controls and parameters, the base of all derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from osimlite.base.deprecation import make_deprecated_property
from osimlite.base.records import replace
from osimlite.derivatives.parameters import Parameters
from osimlite.mechanics.kernels.layout import CONSTRAINED, MODEL
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.simulation.constrained import find_consistent_state
from osimlite.simulation.elements import Forces, force_elements
from osimlite.simulation.elements.probe_type import DeclaredProbe
from osimlite.simulation.pack import PackedModel, pack
from osimlite.simulation.states import StateLayout, sort_by_component


class DifferentiableModel:
    """Model with named states, controls and parameters, whatever the method of differentiation.

    Args:
        model: model to differentiate.
        parameters: paths of numbers that the rates are functions of.
        folder: folder of the model's file.
        keep_fixed_bodies: whether bodies that never move relative to one another remain separate links.

    Attributes:
        name: name of the model.
        states: names of the entries of x as in ``states.sto``: values, speeds, auxiliary states,
            each in the order of the model. Locked coordinates have none.
        system_states: the same names in the order of Simbody's system.
        state_indices: index of each of `states` in the order of the kernels.
        controls: names of the entries of u: paths of the actuators.
        parameters: names of the entries of p.
        p: values of the parameters in the model (p,).
        x: initial state (x,), which fulfils the constraints.
        u: controls (u,), all zero.
        coordinates: paths of the coordinates with accelerations, in the order of the speeds.
        constraint_count: number of constraint equations.
    """

    def __init__(
        self,
        model: Model,
        parameters: Sequence[str],
        folder: Path,
        *,
        keep_fixed_bodies: bool = False,
    ) -> None:
        self._folder = folder
        self._model = model
        # The inertia of merged bodies is not a linear function of masses and positions, those of
        # separate bodies are.
        self._keep_fixed_bodies = keep_fixed_bodies or bool(parameters)
        self.name = model.name or "model"
        self.parameters = tuple(parameters)
        self.mechanism: Mechanism = build_mechanism(model)
        self.forces = self._collect_forces(model, self.mechanism)
        self._packed: PackedModel = pack(
            self.mechanism, self.forces, keep_fixed_bodies=self._keep_fixed_bodies
        )
        self._state = StateLayout(self.mechanism, self._packed.order, self.forces.elements)
        infos = self.mechanism.coordinates
        coordinate_states = [
            f"{infos[index].path}/{quantity}"
            for quantity in ("value", "speed")
            for index in self._packed.order
        ]
        coordinate_state_count = len(coordinate_states)
        paths = self._state.paths
        self.coordinates = tuple(
            path.rpartition("/")[0]
            for path in sort_by_component(model, coordinate_states[: coordinate_state_count // 2])
        )
        values, speeds = (
            [f"{path}/{quantity}" for path in self.coordinates] for quantity in ("value", "speed")
        )
        self.states = (*values, *speeds, *sort_by_component(model, paths))
        self.system_states = (*coordinate_states, *paths)
        names = {name: index for index, name in enumerate(self.system_states)}
        # From the order of the model, which users see, to that of the engine.
        self.state_indices = [names[name] for name in self.states]
        self.controls = self.forces.controls.names
        self.u = np.zeros(len(self.controls))
        start, rates = find_consistent_state(
            self.mechanism,
            [i.default_value for i in infos],
            [i.default_speed for i in infos],
            (),
            (),
        )
        self.x = np.array(self._state.pack(start.tolist(), rates.tolist()))[self.state_indices]
        self._parameters = (
            Parameters(model.copy_deep(), self.parameters, self._pack_numbers)
            if parameters
            else None
        )
        self.p = self._parameters.values if self._parameters else np.zeros(0)
        at_equations = self._packed.structure[MODEL.CONSTRAINED]
        self.constraint_count = (
            int(self._packed.structure[at_equations + CONSTRAINED.EQUATIONS]) if at_equations else 0
        )

    constraints_kept = make_deprecated_property("constraint_count")

    in_system = make_deprecated_property("system_states")

    def _collect_forces(self, model: Model, mechanism: Mechanism) -> Forces:
        """Return the forces and probes of a model.

        Args:
            model: model with the forces.
            mechanism: mechanism of the model.

        Returns:
            Forces; probes give their values without their operation over time.
        """
        forces = force_elements(model, mechanism, folder=self._folder)
        # Probes are outputs without their operation over time. Probes that Python measures after the
        # kernels have no formula.
        measurable = (
            e
            for e in forces.elements
            if not (isinstance(e, DeclaredProbe) and e.probe_type.measure)
        )
        elements = (
            replace(e, operation="value") if isinstance(e, DeclaredProbe) else e for e in measurable
        )
        return replace(forces, elements=tuple(elements))

    def _pack_numbers(self, changed_model: Model) -> Array:
        """Return the numbers that may depend on parameters.

        Args:
            changed_model: the model with other values of the parameters.

        Returns:
            Numbers (k,); none if the structure of the model changes.
        """
        mechanism = build_mechanism(changed_model)
        packed = pack(
            mechanism,
            self._collect_forces(changed_model, mechanism),
            keep_fixed_bodies=self._keep_fixed_bodies,
        )
        return (
            packed.numbers
            # A change of the structure, such as of a number of points, is not a change of numbers:
            # an empty result reports it.
            if np.array_equal(packed.structure, self._packed.structure)
            else np.zeros(0)
        )
