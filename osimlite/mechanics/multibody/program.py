"""Mechanism in the vectors of the kernels, which run on it as Python.

:mod:`osimlite.mechanics.kernels.layout` describes the vectors. Every state has a work vector of its
own, so that results of different states are independent.
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from osimlite.mechanics.kernels.layout import CONSTRAINED, CONSTRAINT, DOF, MODEL, REALS
from osimlite.mechanics.kernels.pointers import Floats, Ints, register_law
from osimlite.mechanics.kernels.table import LAW_NUMBERS, load_kernel
from osimlite.mechanics.multibody.constraints import ConstraintEquations, Equations
from osimlite.mechanics.multibody.functions import make_floats
from osimlite.mechanics.multibody.links import LinkPacker, LinkTree
from osimlite.mechanics.multibody.parts import GROUND
from osimlite.mechanics.multibody.spatial import Array

_ENDS = CONSTRAINT.FIRST_EQUATION, CONSTRAINT.END_EQUATION, CONSTRAINT.END_POSITION


class PackedMechanism:
    """Packed mechanism, all of whose coordinates are degrees of freedom.

    Attributes:
        model: integers, with addresses that are valid in this process.
        reals: numbers of the mechanism without gravity.
        heavy: numbers of the mechanism with gravity.
        laws: names of the laws that are called.
        tree: links of the mechanism.
        order: index in the mechanism of the coordinate of each degree of freedom.
        freedoms: degree of freedom of each coordinate.
        links: link of each body, and of ground as the last (b + 1,); -1 for ground.
        frames: frame of each body in its link (b + 1, 4, 4).
        constraints: number of each constraint, by its identity.
        bound: indices of the coordinates in constraints.
        on_bodies: whether a constraint involves bodies.

    Args:
        tree: links of the mechanism.
        constraints: constraints to include.
    """

    def __init__(self, tree: LinkTree, constraints: Sequence[ConstraintEquations]) -> None:
        packer = LinkPacker(tree)
        packer.mechanism_records(constraints)
        ints, order = packer.ints, tree.order
        ints[MODEL.STATE_SIZE], ints[MODEL.WORK_SIZE] = 2 * len(order), packer.work
        self.laws, self.tree = [*dict.fromkeys(packer.laws)], tree
        for name in self.laws:
            ints[MODEL.LAWS + LAW_NUMBERS[name]] = register_law(load_kernel(name))
        integers: Any = memoryview(array("q", ints))
        self.model: Ints = integers
        # Kinematics must not contain gravity, which the kernels treat as an acceleration of ground.
        self.reals, self.heavy = make_floats(packer.numbers), make_floats(packer.numbers)
        for k in range(REALS.GRAVITY, REALS.GRAVITY + 3):
            self.reals[k] = 0.0
        self.order = list(order)
        self.freedoms = np.argsort(order)
        self.constraints = {id(item): number for number, item in enumerate(constraints)}
        self.bound = frozenset(index for item in constraints for index in item.coordinates)
        self.on_bodies = any(item.bodies for item in constraints)
        placements = [*tree.link_map.placements, tree.link_map.placement(GROUND)]
        self.links = np.array([item.link for item in placements])
        self.frames = np.array([item.frame for item in placements])
        # Keep a reference to each constraint, so that its identity is not given to another object.
        self._references = [*constraints]
        self._others: dict[int, PackedMechanism] = {}

    def find_program(self, constraint: ConstraintEquations) -> PackedMechanism:
        """Return the program if it contains a constraint, else one with this constraint only."""
        if id(constraint) in self.constraints:
            return self
        if id(constraint) not in self._others:
            self._others[id(constraint)] = PackedMechanism(self.tree, (constraint,))
        return self._others[id(constraint)]

    def equations_of(self, constraint: ConstraintEquations) -> tuple[int, int, int]:
        """Return the range of the equations of a constraint of this program.

        Args:
            constraint: the constraint.

        Returns:
            First equation, end of its equations, and end of those that constrain positions.
        """
        s = self.model
        record = s[
            s[s[MODEL.CONSTRAINED] + CONSTRAINED.CONSTRAINT_AT] + self.constraints[id(constraint)]
        ]
        return tuple(s[record + k] for k in _ENDS)

    def equations(self, data: Floats) -> Equations:
        """Return all equations from a work vector after `evaluate_constraints`."""
        size = len(self.order)
        if not self.constraints:
            return Equations(np.zeros(0), np.zeros((0, size)), np.zeros(0), np.zeros(0))
        h = self.model[self.model[MODEL.CONSTRAINED] :]
        vector = np.frombuffer(data)
        count = h[CONSTRAINED.EQUATIONS]
        # Columns are in the order of degrees of freedom; the mechanism's order is that of
        # coordinates.
        rows = vector[h[CONSTRAINED.WORK_ROWS] :][: count * size].reshape(count, size)[
            :, self.freedoms
        ]
        fields = (CONSTRAINED.WORK_ERRORS, CONSTRAINED.WORK_RATES, CONSTRAINED.WORK_DRIFTS)
        errors, rates, drifts = (vector[h[field] :][:count].copy() for field in fields)
        return Equations(errors, rows, rates, drifts)

    @cached_property
    def still(self) -> NDArray[np.bool_]:
        """Table (b + 1, n) of whether a body, the last being ground, ignores a coordinate."""
        links, ends, order, _ = self.tree
        is_independent = np.ones((len(links) + 1, len(order)), dtype=bool)
        for number, link in enumerate(links):
            is_independent[number] = is_independent[link.parent]
            is_independent[number, list(order[ends[number] : ends[number + 1]])] = False
        return np.asarray(is_independent[self.links])

    @cached_property
    def _entries(self) -> NDArray[np.int_]:
        """Row, column and offset in the work vector of the stored entries of M (3, k)."""
        s = self.model
        entries = []
        for freedom in range(len(self.order)):
            record = s[s[MODEL.DOF_AT] + DOF.SIZE * freedom :]
            ancestor = freedom
            offset = record[DOF.ROW]
            while ancestor >= 0:
                entries.append((self.order[freedom], self.order[ancestor], offset))
                ancestor = s[s[MODEL.DOF_AT] + DOF.SIZE * ancestor + DOF.ABOVE]
                offset += 1
        return np.array(entries, dtype=int).reshape(-1, 3).T

    def mass_matrix(self, data: Floats) -> Array:
        """Return the mass matrix (n, n) from a work vector."""
        (rows, columns, offsets), size = self._entries, len(self.order)
        matrix = np.zeros((size, size))
        matrix[rows, columns] = matrix[columns, rows] = np.frombuffer(data)[offsets]
        return matrix

    def state(self, q: Array, u: Array) -> tuple[Floats, Floats, Floats]:
        """Return new vectors for a state.

        Args:
            q: coordinate values (n,).
            u: generalized speeds (n,).

        Returns:
            Work vector, state, and rates, which equal the speeds but for balls.
        """
        values, speeds = q[self.order].tolist(), u[self.order].tolist()
        return (
            make_floats(bytes(8 * self.model[MODEL.WORK_SIZE])),
            make_floats([*values, *speeds]),
            make_floats([*speeds, *speeds]),
        )
