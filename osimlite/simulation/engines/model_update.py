"""Update of the compiled engine after numbers of its model have changed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from osimlite.base.records import replace
from osimlite.mechanics.kernels.layout import ITEM, MODEL
from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.multibody.build import mass_properties
from osimlite.mechanics.multibody.constraints import Lock
from osimlite.mechanics.multibody.links import LinkMap
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.schema.base import Component
from osimlite.schema.forces import Force
from osimlite.schema.frames import Body
from osimlite.schema.model import Model
from osimlite.schema.sets import Controller
from osimlite.simulation.batches import UpdatedModel
from osimlite.simulation.elements import ElementBuilder, Forces
from osimlite.simulation.elements.controls import Controls, ModelControls
from osimlite.simulation.elements.force_records import ForceRecord
from osimlite.simulation.elements.probe_type import DeclaredProbe, make_probes
from osimlite.simulation.elements.registry import FORCE_TYPES
from osimlite.simulation.pack import pack

if TYPE_CHECKING:
    from osimlite.simulation.engines.compiled import CompiledEngine


class NumberUpdater:
    """Updater of the numbers of a packed model after changes of forces, masses or gravity.

    Searches and sweeps change few numbers of a model many times. Packing it anew takes longer than
    many a motion, so the numbers are replaced where the structure stays the same.

    Args:
        model: the model, in which only forces, masses and gravity change.
        engine: engine of the model before the change.
        folder: folder of the model's file.
        wrapping: method of wrapping, see :class:`osimlite.simulation.Options`.
    """

    def __init__(self, model: Model, engine: CompiledEngine, folder: Path, wrapping: str) -> None:
        self._model, self._engine = model, engine
        self._mechanism: Mechanism = engine.mechanism
        self._forces: Forces = engine.forces
        self._components = model.tree().by_path
        self._builder = ElementBuilder(model, engine.mechanism, folder, wrapping=wrapping)
        dof_indices = {offset: number for number, offset in enumerate(engine.order)}
        self._link_map = LinkMap(engine.mechanism, dof_indices, engine.placements)
        self._items = {
            element.path: element.make_records(self._link_map) for element in engine.forces.elements
        }
        # Elements change at fixed offsets. Their numbers precede those of the controls, which are
        # last, in the same order as here.
        controls = engine.structure[MODEL.CONTROLS]
        numbers_end = (
            engine.structure[controls + ITEM.NUMBERS] if controls > 0 else len(engine.numbers)
        )
        self._first, offset = (
            {},
            numbers_end - sum(_count_numbers(items) for items in self._items.values()),
        )
        for path, items in self._items.items():
            self._first[path] = offset
            offset += _count_numbers(items)

    def update(self, owners: Sequence[Component]) -> UpdatedModel | None:
        """Return the model with the present properties of its forces and bodies.

        Args:
            owners: forces, controllers, bodies and the model itself, if one of their properties has
                changed.

        Returns:
            The changed model; None if more than numbers changed.
        """
        new_elements: dict[str, Any] = {}
        owners = list(owners)
        controls = self._forces.controls
        controllers = [
            self._builder.path(owner) for owner in owners if isinstance(owner, Controller)
        ]
        if controllers:
            for path in controllers:
                # Other controllers may name files, which are not read again.
                self._builder.drives.pop(path, None)
            self._builder.controls = ModelControls(self._builder)
            controls = self._builder.controls.controls
            # The gain of a reflex is stored with the muscle.
            owners += [
                self._components[path]
                for path in self._builder.controls.reflexes
                if path in self._items
            ]
        sharing = {
            type(owner)
            for owner in owners
            if getattr(FORCE_TYPES.find(type(owner)), "shares_numbers", False)
        }
        for force in (
            *owners,
            *(other for force_class in sharing for other in self._model.components(force_class)),
        ):
            if isinstance(force, Force):
                element = self._builder.make_element(force)
                new_elements[element.path] = element
        if not new_elements.keys() <= self._items.keys():
            return None
        only_forces = all(isinstance(owner, Force | Controller) for owner in owners)
        has_probes = any(isinstance(element, DeclaredProbe) for element in self._forces.elements)
        if has_probes and not all(isinstance(owner, Controller) for owner in owners):
            if not only_forces:
                # Metabolic probes depend on the mass of the model.
                return None
            new_elements |= {
                probe.path: probe for probe in make_probes(self._builder, self._forces.elements)
            }
        elements = tuple(
            new_elements.get(element.path, element) for element in self._forces.elements
        )
        forces = replace(self._forces, elements=elements, controls=controls)
        mechanism = self._mechanism if only_forces else self._replace_masses()
        if mechanism is None:
            return None
        numbers = (
            self._replace_force_numbers(new_elements, forces.controls)
            if only_forces
            else self._pack_numbers(mechanism, forces)
        )
        return None if numbers is None else UpdatedModel(mechanism, forces, numbers, self._engine)

    def _replace_force_numbers(
        self, new_elements: Mapping[str, Any], controls: Controls
    ) -> Floats | None:
        """Return the numbers of the model with those of some forces replaced.

        Args:
            new_elements: new force elements by path.
            controls: the controls, new or as before.

        Returns:
            The numbers (m,); None if the structure of a force or of the controls changed.
        """
        numbers = self._engine.numbers.copy()
        for path, element in new_elements.items():
            items = element.make_records(self._link_map)
            if [_describe_structure(item) for item in items] != [
                _describe_structure(item) for item in self._items[path]
            ]:
                return None
            offset = self._first[path]
            numbers[offset : offset + _count_numbers(items)] = [
                x for item in items for x in item.numbers
            ]
        if controls is not self._forces.controls:
            structure = self._engine.structure
            offset = structure[MODEL.CONTROLS]
            ints, control_numbers, _ = controls.make_record()
            if structure[offset + ITEM.DETAILS :].tolist() != ints:
                return None
            numbers[structure[offset + ITEM.NUMBERS] :] = control_numbers
        return numbers

    def _replace_masses(self) -> Mechanism | None:
        """Return the mechanism with the present masses and gravity.

        Returns:
            The mechanism; None if more than numbers may have changed.
        """
        mechanism = self._mechanism
        if not all(isinstance(item, Lock) for item in mechanism.constraints):
            # The masses decide where loops are cut and bodies are split.
            return None
        bodies = []
        for body in mechanism.bodies:
            component = self._components.get(body.path)
            if not isinstance(component, Body):
                return None
            bodies.append(replace(body, mass_properties=mass_properties(component, body.path)))
        return replace(
            mechanism, bodies=tuple(bodies), gravity=np.array(self._model.gravity, dtype=float)
        )

    def _pack_numbers(self, mechanism: Mechanism, forces: Forces) -> Floats | None:
        """Return the numbers of a newly packed model.

        Args:
            mechanism: mechanism of the model.
            forces: forces of the model.

        Returns:
            The numbers (m,); None if the structure differs from the engine's.
        """
        packed = pack(mechanism, forces)
        has_same_structure = np.array_equal(packed.structure, self._engine.structure)
        return packed.numbers if has_same_structure and packed.order == self._engine.order else None


def _count_numbers(items: Sequence[ForceRecord]) -> int:
    """Return the number of numbers of some items."""
    return sum(len(item.numbers) for item in items)


def _describe_structure(item: ForceRecord) -> tuple[object, ...]:
    """Return everything of an item except its numbers."""
    return (
        item.kernel,
        item.ints,
        len(item.numbers),
        item.record_size,
        item.is_contact,
        item.is_part,
    )
