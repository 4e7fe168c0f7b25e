"""Packing of a mechanism and its forces into the vectors of the kernels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.batched_curves import CURVE_ROW, LANES
from osimlite.mechanics.kernels.layout import CONTACT_WORK, EQUILIBRIUM, ITEM, MODEL, RESPONSE, RUN
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.kernels.record import STATES
from osimlite.mechanics.multibody.links import LinkPacker, LinkTree, Placement, tree_of
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.simulation.constrained import find_free_coordinates, select_constraints
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.force_records import CONTROLS, ForceElement, Response
from osimlite.simulation.states import StateLayout

if TYPE_CHECKING:
    from osimlite.simulation.pack_chain import Chain

MIN_BATCHED_ITEMS = 8
"""Number of consecutive items of one type from which a batched kernel is faster."""


@dataclass
class PackedModel:
    """Mechanism with its forces as vectors of the kernels, without addresses."""

    structure: Ints  # integers without addresses
    numbers: Floats  # numbers of the model
    laws: tuple[str, ...]  # names of laws that the engine calls itself
    # kernel of each item by its offset in the structure: a name, or a Python function
    kernels: dict[int, str | Callable[..., None]]
    # kernel that equilibrates an item, by its offset in the structure
    equilibria: dict[int, str]
    # kernel of an item's derivatives, by its offset in the structure
    responses: dict[int, str]
    # kernel of several items, by the offset of their record in the structure
    runs: dict[int, str]
    # index of the force element of each item, by the item's offset in the structure
    owners: dict[int, int]
    order: tuple[int, ...]  # index in the mechanism of the coordinate of each degree of freedom
    placements: list[Placement]  # link of every body (-1 for ground), and its frame in the link
    # records of the items of every force element in the work vector, as (offset, length)
    items: list[list[tuple[int, int]]]


def pack(
    mechanism: Mechanism,
    forces: Forces,
    chain: Chain | None = None,
    *,
    keep_fixed_bodies: bool = False,
) -> PackedModel:
    """Pack a mechanism and its forces into vectors.

    Args:
        mechanism: the mechanism.
        forces: forces on it besides gravity.
        chain: joints whose mass matrix another program computes; None if the kernels compute it.
        keep_fixed_bodies: whether a body that never moves in its parent is a link of its own.

    Returns:
        The packed model.

    Raises:
        UnsupportedError: the kernels do not support a joint, function, constraint or force.
    """
    tree = tree_of(mechanism, find_free_coordinates(mechanism), keep_fixed_bodies=keep_fixed_bodies)
    return Packer(
        tree, forces, StateLayout(mechanism, tree.order, forces.elements), chain
    ).pack_model()


class Packer(LinkPacker):
    """Writer of the kernel vectors of one model.

    Args:
        tree: tree of the mechanism's links.
        forces: forces on the mechanism.
        state: layout of the state.
        chain: joints whose mass matrix another program computes, if any.
    """

    def __init__(
        self, tree: LinkTree, forces: Forces, state: StateLayout, chain: Chain | None
    ) -> None:
        super().__init__(tree)
        self.chain = chain
        self.elements: Sequence[ForceElement] = forces.elements
        self.controls = forces.controls
        self.state = state
        self.kernels: dict[int, str | Callable[..., None]] = {}
        self.equilibria: dict[int, str] = {}
        self.responses: dict[int, str] = {}
        self.owners: dict[int, int] = {}
        self.runs: dict[int, str] = {}

    def pack_model(self) -> PackedModel:
        """Return the packed model, with all records of the model."""
        ints = self.ints
        self.mechanism_records(*select_constraints(self.link_map.mechanism, self.order))
        if self.chain is not None:
            from osimlite.simulation.pack_chain import pack_chain

            pack_chain(self, self.chain)
        # Items refer to the controls by offset, so these have to be reserved first.
        ints[MODEL.WORK_CONTROL] = self.reserve_work(len(self.controls.names))
        # Controls are written last, because `System.set_controls` may replace their record by a
        # longer one.
        result = self.write_items()
        self.write_controls()
        ints[MODEL.STATE_SIZE] = self.state.size
        ints[MODEL.WORK_STATE] = self.reserve_work(ints[MODEL.STATE_SIZE] * STATES)
        ints[MODEL.WORK_SIZE] = self.work
        structure = np.array(ints, dtype=np.int64)
        numbers = np.array(self.numbers, dtype=np.float64)
        laws = tuple(dict.fromkeys(self.laws))
        offset_tables = self.kernels, self.equilibria, self.responses, self.runs, self.owners
        return PackedModel(
            structure, numbers, laws, *offset_tables, self.order, self.link_map.placements, result
        )

    def write_items(self) -> list[list[tuple[int, int]]]:
        """Write the items of all force elements.

        The records of contacts come first in the work vector, in the order of the elements, so that
        one view covers all contact forces.

        Returns:
            Records of the items of each element in the work vector, as (offset, length).
        """
        groups = [element.make_records(self.link_map) for element in self.elements]
        self.ints[MODEL.CONTACTS] = sum(item.is_contact for group in groups for item in group)
        contact = self.ints[MODEL.WORK_CONTACT] = self.reserve_work(
            CONTACT_WORK.SIZE * self.ints[MODEL.CONTACTS]
        )
        records: list[int] = []
        pairs: list[int] = []
        settling: dict[int, str] = {}
        responding: dict[int, Response] = {}
        runs: list[tuple[str, int]] = []
        result: list[list[tuple[int, int]]] = []
        record_offsets = {CONTROLS: self.ints[MODEL.WORK_CONTROL]}
        for owner, (element, group) in enumerate(zip(self.elements, groups, strict=True)):
            result.append([])
            first = len(pairs)
            for item in group:
                record_offset = (
                    contact + CONTACT_WORK.SIZE * len(pairs)
                    if item.is_contact
                    else self.reserve_work(item.record_size)
                )
                size = CONTACT_WORK.SIZE if item.is_contact else item.record_size
                result[-1].append((record_offset, size))
                if item.is_contact:
                    pairs.append(len(self.ints))
                # Parts of a path are evaluated by the path itself. Consecutive items of one batched
                # kernel form a run.
                if not item.is_part:
                    if not runs or runs[-1][0] != item.batched:
                        runs.append((item.batched, len(records)))
                    records.append(len(self.ints))
                if item.kernel or item.python is not None:
                    self.kernels[len(self.ints)] = (
                        item.kernel if item.python is None else item.python
                    )
                self.owners[len(self.ints)] = owner
                if item.equilibrium:
                    settling[len(self.ints)] = item.equilibrium
                if item.response is not None:
                    responding[len(self.ints)] = item.response
                # Offsets of states and of records of other elements are known only here.
                item_ints = list(item.ints)
                for number, at_state in enumerate(item.states):
                    item_ints[at_state] = self.state.find_first_state(element) + number
                for number, path in item.record_references:
                    item_ints[number] += record_offsets[path]
                record_offsets[element.path] = record_offset
                self.ints += [*self.make_item_head(record_offset, first), *item_ints]
                self.numbers += item.numbers
        self.ints[MODEL.ITEMS], self.ints[MODEL.ITEM_AT] = len(records), len(self.ints)
        self.ints += records
        self.ints[MODEL.CONTACT_AT] = len(self.ints)
        self.ints += pairs
        self.ints[MODEL.EQUILIBRIA], self.ints[MODEL.EQUILIBRIUM_AT] = len(settling), len(self.ints)
        for item_offset, kernel in settling.items():
            self.equilibria[len(self.ints)] = kernel
            self.ints += EQUILIBRIUM.record(KERNEL=0, ITEM=item_offset)
        self.ints[MODEL.RESPONSES], self.ints[MODEL.RESPONSE_AT] = len(responding), len(self.ints)
        for item_offset, response in responding.items():
            self.responses[len(self.ints)] = response.kernel
            first_state = ITEM.DETAILS + response.first_state
            self.ints += RESPONSE.record(
                KERNEL=0,
                ITEM=item_offset,
                FIRST_STATE=first_state,
                STATES=response.states,
                SENSE=response.sense,
            )
        # All runs share one workspace, since they are evaluated one after the other.
        curve_work = (
            self.reserve_work(LANES * CURVE_ROW.SIZE) if any(kernel for kernel, _ in runs) else 0
        )
        self.ints[MODEL.RUNS], self.ints[MODEL.RUN_AT] = len(runs), len(self.ints)
        for (kernel, first), end in zip(
            runs, [*(run[1] for run in runs[1:]), len(records)], strict=False
        ):
            # Runs that are too short get no kernel, and their items are evaluated singly.
            if end - first >= MIN_BATCHED_ITEMS and kernel:
                self.runs[len(self.ints)] = kernel
            self.ints += RUN.record(LAW=0, FIRST=first, END=end, WORKSPACE=curve_work)
        return result

    def make_item_head(self, record_offset: int, first_contact: int) -> list[int]:
        """Return the head of an item's record, without the address of its law.

        Args:
            record_offset: offset of its record in the work vector.
            first_contact: index of the first contact of its force.
        """
        return ITEM.record(
            LAW=0, NUMBERS=len(self.numbers), RECORD=record_offset, FIRST_CONTACT=first_contact
        )

    def write_controls(self) -> None:
        """Write the record of the controls at the end, where :meth:`System.set_controls` can replace it."""
        if not self.controls.names:
            return
        self.ints[MODEL.CONTROLS] = len(self.ints)
        control_ints, numbers, self.kernels[len(self.ints)] = self.controls.make_record()
        self.ints += [*self.make_item_head(self.ints[MODEL.WORK_CONTROL], 0), *control_ints]
        self.numbers += numbers
