"""The parts of a model that some numbers have a part in, made anew for the compiled engine."""

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
from osimlite.mechanics.multibody.links import Places
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.schema.base import Component
from osimlite.schema.forces import Force
from osimlite.schema.frames import Body
from osimlite.schema.model import Model
from osimlite.schema.sets import Controller
from osimlite.simulation.batches import Renewed
from osimlite.simulation.elements import ElementBuilder, Forces
from osimlite.simulation.elements.controls import Controls, ModelControls
from osimlite.simulation.elements.force_records import ForceRecord
from osimlite.simulation.elements.probe_type import DeclaredProbe, make_probes
from osimlite.simulation.elements.registry import FORCE_TYPES
from osimlite.simulation.pack import pack

if TYPE_CHECKING:
    from osimlite.simulation.engines.compiled import CompiledEngine


class NumbersOnly:
    """Makes those parts of a model anew that its forces, masses and gravity have a part in.

    Args:
        model: of which nothing else changes.
        engine: of the same model before.
        folder: of its file.
        wrapping: how its paths bend around surfaces.
    """

    def __init__(self, model: Model, engine: CompiledEngine, folder: Path, wrapping: str) -> None:
        self._model, self._engine = model, engine
        self._mechanism: Mechanism = engine.mechanism
        self._forces: Forces = engine.forces
        self._components = model.tree().by_path
        self._builder = ElementBuilder(model, engine.mechanism, folder, wrapping=wrapping)
        freedoms = {place: number for number, place in enumerate(engine.order)}
        self._places = Places(engine.mechanism, freedoms, engine.placements)
        self._items = {
            element.path: element.make_records(self._places) for element in engine.forces.elements
        }
        # The numbers of all items are the last ones before those of the controls, in their order.
        controls = engine.structure[MODEL.CONTROLS]
        end = engine.structure[controls + ITEM.NUMBERS] if controls > 0 else len(engine.numbers)
        self._first, place = {}, end - sum(_length(items) for items in self._items.values())
        for path, items in self._items.items():
            self._first[path] = place
            place += _length(items)

    def renewed(self, owners: Sequence[Component]) -> Renewed | None:
        """The model with what its forces and bodies are now; None if more has changed than numbers.

        Args: owners: forces, controllers, bodies and the model itself, if a property of theirs has
            changed.
        """
        made: dict[str, Any] = {}
        owners, controls = list(owners), self._forces.controls
        controllers = [
            self._builder.path(owner) for owner in owners if isinstance(owner, Controller)
        ]
        if controllers:
            for path in controllers:
                # Others may have files that are read no more.
                self._builder.drives.pop(path, None)
            self._builder.controls = ModelControls(self._builder)
            controls = self._builder.controls.controls
            # The gain of a reflex is a number of the muscle.
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
            *(other for each in sharing for other in self._model.components(each)),
        ):
            if isinstance(force, Force):
                element = self._builder.make_element(force)
                made[element.path] = element
        if not made.keys() <= self._items.keys():
            return None
        only_forces = all(isinstance(owner, Force | Controller) for owner in owners)
        has_probes = any(isinstance(element, DeclaredProbe) for element in self._forces.elements)
        if has_probes and not all(isinstance(owner, Controller) for owner in owners):
            if not only_forces:
                # The mass of the model has a say in what muscles use.
                return None
            made |= {
                probe.path: probe for probe in make_probes(self._builder, self._forces.elements)
            }
        elements = tuple(made.get(element.path, element) for element in self._forces.elements)
        forces = replace(self._forces, elements=elements, controls=controls)
        mechanism = self._mechanism if only_forces else self._with_masses()
        if mechanism is None:
            return None
        numbers = (
            self._with_forces(made, forces.controls)
            if only_forces
            else self._packed(mechanism, forces)
        )
        return None if numbers is None else Renewed(mechanism, forces, numbers, self._engine)

    def _with_forces(self, made: Mapping[str, Any], controls: Controls) -> Floats | None:
        """The given numbers with those of some elements, and of the controls, in their places."""
        numbers = self._engine.numbers.copy()
        for path, element in made.items():
            items = element.make_records(self._places)
            if [_kind(item) for item in items] != [_kind(item) for item in self._items[path]]:
                return None
            place = self._first[path]
            numbers[place : place + _length(items)] = [x for item in items for x in item.numbers]
        if controls is not self._forces.controls:
            structure = self._engine.structure
            place = structure[MODEL.CONTROLS]
            ints, own, _ = controls.make_record()
            if structure[place + ITEM.OWN :].tolist() != ints:
                return None
            numbers[structure[place + ITEM.NUMBERS] :] = own
        return numbers

    def _with_masses(self) -> Mechanism | None:
        """The mechanism with the masses and the gravity that the model has now."""
        mechanism = self._mechanism
        if not all(isinstance(item, Lock) for item in mechanism.constraints):
            # Masses have a say in where loops are cut, and bodies are parted there.
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

    def _packed(self, mechanism: Mechanism, forces: Forces) -> Floats | None:
        packed = pack(mechanism, forces)
        is_alike = np.array_equal(packed.structure, self._engine.structure)
        return packed.numbers if is_alike and packed.order == self._engine.order else None


def _length(items: Sequence[ForceRecord]) -> int:
    return sum(len(item.numbers) for item in items)


def _kind(item: ForceRecord) -> tuple[object, ...]:
    """What of an item is not its numbers."""
    return (
        item.kernel,
        item.ints,
        len(item.numbers),
        item.record_size,
        item.is_contact,
        item.is_part,
    )
