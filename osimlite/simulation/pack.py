"""From a mechanism and its forces to the vectors that the kernels work on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.batched_curves import LANES, ROWS
from osimlite.mechanics.kernels.layout import CONTACT_WORK, EQUILIBRIUM, ITEM, MODEL, RESPONSE, RUN
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.kernels.record import STATES
from osimlite.mechanics.multibody.links import LinkPacker, Placement, Tree, tree_of
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.simulation.constrained import constraints_on, free_coordinates
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.force_records import CONTROLS, ForceElement, Response
from osimlite.simulation.states import StateLayout

if TYPE_CHECKING:
    from osimlite.simulation.pack_chain import Chain

FEWEST = 8
"""Items that follow one another and are worth a kernel of their own."""


@dataclass
class Packed:
    """A mechanism with its forces, packed."""

    structure: Ints  # the integers, with no addresses in them
    numbers: Floats  # the numbers
    laws: tuple[str, ...]  # names of the engine's own functions that must be there
    # by place in the structure what computes an item: a name, or a function of Python
    kernels: dict[int, str | Callable[..., None]]
    # by place in the structure the name of what brings an item into equilibrium
    equilibria: dict[int, str]
    # by place in the structure the name of what finds the derivatives of an item
    responses: dict[int, str]
    # by place in the structure the name of what computes several items at once
    runs: dict[int, str]
    owners: dict[int, int]  # by place in the structure of an item the number of its force element
    order: tuple[int, ...]  # place in the mechanism of the coordinate of each degree of freedom
    placements: list[Placement]  # of every body its link (-1 for ground) and its frame in that
    # of every force element the records of its items in the work vector, as place and length
    items: list[list[tuple[int, int]]]


def pack(
    mechanism: Mechanism, forces: Forces, chain: Chain | None = None, *, apart: bool = False
) -> Packed:
    """Pack a mechanism and its forces.

    Args:
        mechanism: what moves.
        forces: what pushes it, besides gravity.
        chain: of joints whose mass matrix another program computes; the kernels do without one.
        apart: whether bodies that never move in one another are links of their own.

    Raises:
        UnsupportedError: a joint, a function, a constraint or a force that the kernels do not know.
    """
    tree = tree_of(mechanism, free_coordinates(mechanism), apart=apart)
    return Packer(tree, forces, StateLayout(mechanism, tree.order, forces.elements), chain).packed()


class Packer(LinkPacker):
    """Puts everything at its place in the vectors."""

    def __init__(self, tree: Tree, forces: Forces, state: StateLayout, chain: Chain | None) -> None:
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

    def packed(self) -> Packed:
        """Everything."""
        ints = self.ints
        self.mechanism_records(*constraints_on(self.places.mechanism, self.order))
        if self.chain is not None:
            from osimlite.simulation.pack_chain import pack_chain

            pack_chain(self, self.chain)
        ints[MODEL.WORK_CONTROL] = self.reserve_work(len(self.controls.names))
        result = self.item_records()
        self.control_record()
        ints[MODEL.STATE_SIZE] = self.state.size
        ints[MODEL.WORK_STATE] = self.reserve_work(ints[MODEL.STATE_SIZE] * STATES)
        ints[MODEL.WORK_SIZE] = self.work
        structure, numbers = (
            np.array(ints, dtype=np.int64),
            np.array(self.numbers, dtype=np.float64),
        )
        laws = tuple(dict.fromkeys(self.laws))
        asked = self.kernels, self.equilibria, self.responses, self.runs, self.owners
        return Packed(structure, numbers, laws, *asked, self.order, self.places.placements, result)

    def item_records(self) -> list[list[tuple[int, int]]]:
        """Write the items; the records of the contacts come first, in their order."""
        groups = [element.make_records(self.places) for element in self.elements]
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
        places = {CONTROLS: self.ints[MODEL.WORK_CONTROL]}
        for owner, (element, group) in enumerate(zip(self.elements, groups, strict=True)):
            result.append([])
            first = len(pairs)
            for item in group:
                place = (
                    contact + CONTACT_WORK.SIZE * len(pairs)
                    if item.is_contact
                    else self.reserve_work(item.record_size)
                )
                size = CONTACT_WORK.SIZE if item.is_contact else item.record_size
                result[-1].append((place, size))
                if item.is_contact:
                    pairs.append(len(self.ints))
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
                own = list(item.ints)
                for number, at_state in enumerate(item.states):
                    own[at_state] = self.state.first_of(element) + number
                for number, path in item.record_references:
                    own[number] += places[path]
                places[element.path] = place
                self.ints += [*self.item_head(place, first), *own]
                self.numbers += item.numbers
        self.ints[MODEL.ITEMS], self.ints[MODEL.ITEM_AT] = len(records), len(self.ints)
        self.ints += records
        self.ints[MODEL.CONTACT_AT] = len(self.ints)
        self.ints += pairs
        self.ints[MODEL.EQUILIBRIA], self.ints[MODEL.EQUILIBRIUM_AT] = len(settling), len(self.ints)
        for place, kernel in settling.items():
            self.equilibria[len(self.ints)] = kernel
            self.ints += EQUILIBRIUM.record(KERNEL=0, ITEM=place)
        self.ints[MODEL.RESPONSES], self.ints[MODEL.RESPONSE_AT] = len(responding), len(self.ints)
        for place, response in responding.items():
            self.responses[len(self.ints)] = response.kernel
            first_state = ITEM.OWN + response.first_state
            self.ints += RESPONSE.record(
                KERNEL=0,
                ITEM=place,
                FIRST_STATE=first_state,
                STATES=response.states,
                SENSE=response.sense,
            )
        room = self.reserve_work(LANES * ROWS) if any(kernel for kernel, _ in runs) else 0
        self.ints[MODEL.RUNS], self.ints[MODEL.RUN_AT] = len(runs), len(self.ints)
        for (kernel, first), end in zip(
            runs, [*(run[1] for run in runs[1:]), len(records)], strict=False
        ):
            if end - first >= FEWEST and kernel:
                self.runs[len(self.ints)] = kernel
            self.ints += RUN.record(LAW=0, FIRST=first, END=end, ROOM=room)
        return result

    def item_head(self, place: int, first_contact: int) -> list[int]:
        """What stands before an item's own integers, its law not known yet."""
        return ITEM.record(
            LAW=0, NUMBERS=len(self.numbers), RECORD=place, FIRST_CONTACT=first_contact
        )

    def control_record(self) -> None:
        """Write the controls, if there are any, behind all else: some motions have others there."""
        if not self.controls.names:
            return
        self.ints[MODEL.CONTROLS] = len(self.ints)
        own, numbers, self.kernels[len(self.ints)] = self.controls.make_record()
        self.ints += [*self.item_head(self.ints[MODEL.WORK_CONTROL], 0), *own]
        self.numbers += numbers
