"""A mechanism in the vectors of the kernels, which run on it as Python.

:mod:`osimlite.kernels.layout` says what is where. Every state has a work vector of its own, so that nothing that is
known of one changes with another.
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from osimlite.kernels.layout import GRAVITY_AT, MODEL
from osimlite.kernels.pointers import Floats, Ints, address
from osimlite.kernels.table import LAW_NUMBERS, own_function
from osimlite.multibody.constraints import Constraint
from osimlite.multibody.functions import floats
from osimlite.multibody.links import LinkPacker, tree_of
from osimlite.multibody.parts import GROUND
from osimlite.multibody.spatial import Array

if TYPE_CHECKING:
    from osimlite.multibody.mechanism import Mechanism


class Program:
    """A mechanism all of whose coordinates are free, packed.

    Args:
        mechanism: what moves.
        constraints: that are kept up.

    Attributes:
        s: the integers, with addresses that are good in this process.
        x: the numbers, without gravity.
        order: place in the mechanism of the coordinate of each degree of freedom.
        freedoms: degree of freedom of each coordinate.
        links: link of each body, and of ground as the last (b + 1,); -1 for ground.
        frames: each body in its link (b + 1, 4, 4).
        has_balls: whether some speeds are not the rates of coordinates.
    """

    def __init__(self, mechanism: Mechanism, constraints: Sequence[Constraint]) -> None:
        tree = tree_of(mechanism, range(len(mechanism.coordinates)))
        packer = LinkPacker(tree)
        packer.mechanism_records(constraints)
        ints, order = packer.ints, tree.order
        ints[MODEL.STATE_SIZE], ints[MODEL.WORK_SIZE] = 2 * len(order), packer.work
        for name in dict.fromkeys(packer.laws):
            ints[MODEL.LAWS + LAW_NUMBERS[name]] = address(own_function(name))
        integers: Any = memoryview(array("q", ints))
        self.s: Ints = integers
        self.x = floats(packer.numbers)
        for k in range(GRAVITY_AT, GRAVITY_AT + 3):
            self.x[k] = 0.0
        self.order, self.has_balls = list(order), bool(packer.balls)
        self.freedoms = np.argsort(order)
        placements = [*tree.places.placements, tree.places.placement(GROUND)]
        self.links = np.array([item.link for item in placements])
        self.frames = np.array([item.frame for item in placements])
        self._tree = tree

    @cached_property
    def still(self) -> NDArray[np.bool_]:
        """Whether each body (and ground as the last) stays when a coordinate moves (b + 1, n)."""
        links, ends, order, _ = self._tree
        still = np.ones((len(links) + 1, len(order)), dtype=bool)
        for number, link in enumerate(links):
            still[number] = still[link.parent]
            still[number, list(order[ends[number] : ends[number + 1]])] = False
        return np.asarray(still[self.links])

    def state(self, q: Array, u: Array) -> tuple[Floats, Floats, Floats]:
        """A work vector for a state, the state, and room for its derivative."""
        y = floats([*q[self.order].tolist(), *u[self.order].tolist()])
        return floats(bytes(8 * self.s[MODEL.WORK_SIZE])), y, floats(bytes(8 * len(y)))


_programs: WeakKeyDictionary[Mechanism, Program] = WeakKeyDictionary()


def program_of(mechanism: Mechanism) -> Program:
    """The program of a mechanism with its own constraints."""
    if mechanism not in _programs:
        _programs[mechanism] = Program(mechanism, mechanism.constraints)
    return _programs[mechanism]
