"""Segments of a person: which bodies of a model have scale factors of their own, and which share them."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from osimlite.mechanics.multibody.spatial import Array

SIDES = {"r": "l", "l": "r", "right": "left", "left": "right"}
"""What is said of one side of the body, and of the other."""
_SIDE = re.compile(r"right|left|(?<![a-z])[rl](?![a-z])", re.IGNORECASE)


class Segment(NamedTuple):
    """Bodies that have the same factors along some of their axes (0, 1, 2)."""

    bodies: tuple[str, ...]
    axes: tuple[int, ...]


class Segments(NamedTuple):
    """The scale factors of the bodies of a model, as few numbers (k,)."""

    parts: tuple[Segment, ...]  # whose factor each number is
    # pairs of lists of numbers whose means are much the same: segments that hang on one another
    alike: tuple[tuple[tuple[int, ...], tuple[int, ...]], ...]
    # pairs of a number and the list of all numbers of its segment
    sides: tuple[tuple[int, tuple[int, ...]], ...]

    @classmethod
    def of(
        cls, carriers: Mapping[str, str], marked: Collection[str], *, by_axis: bool, symmetric: bool
    ) -> Segments:
        """Those of bodies.

        A body without markers has the factors of the one with markers that it carries, as the talus
        those of the foot, or else of the one that carries it, as the patella, the toes and the
        hand.

        Args: carriers: the body that carries each body, by name, carriers first; bodies on ground
            have another name. marked: bodies with markers. by_axis: whether a body may grow in one
            direction more than in another. symmetric: whether the two sides of the body have the
            same factors.
        """
        if symmetric:
            marked = {*marked, *(other_side(body, carriers) for body in marked)}
        first = {body: body for body in carriers}
        for body, carrier in reversed(list(carriers.items())):
            if carrier in first and carrier not in marked and first[carrier] == carrier:
                first[carrier] = first[body] if first[body] in marked else carrier
        for body, carrier in carriers.items():
            if first[body] not in marked and carrier in first:
                first[body] = first[carrier]
        if symmetric:
            first = {body: min(own, other_side(own, carriers)) for body, own in first.items()}
        groups = {
            name: tuple(body for body in carriers if first[body] == name) for name in first.values()
        }
        parts: list[Segment] = []
        numbers: dict[str, tuple[int, ...]] = {}
        for name, bodies in groups.items():
            axes = ((0,), (1,), (2,)) if by_axis else ((0, 1, 2),)
            numbers[name] = tuple(range(len(parts), len(parts) + len(axes)))
            parts += [Segment(bodies, chosen) for chosen in axes]
        pairs = {
            (first[body], first[carrier]) for body, carrier in carriers.items() if carrier in first
        }
        alike = tuple((numbers[one], numbers[two]) for one, two in sorted(pairs) if one != two)
        sides = tuple((k, own) for own in numbers.values() for k in own if len(own) > 1)
        return cls(tuple(parts), alike, sides)

    def factors(self, sizes: Sequence[float] | Array) -> dict[str, list[float]]:
        """The factors along the axes of each body, by its name, for numbers (k,)."""
        result = {body: [1.0, 1.0, 1.0] for part in self.parts for body in part.bodies}
        for part, size in zip(self.parts, sizes, strict=True):
            for body in part.bodies:
                for axis in part.axes:
                    result[body][axis] = float(size)
        return result

    def expected(self, first: float, apart: float, across: float) -> tuple[Array, Array]:
        """Rows (r, k) and what their products with the numbers usually are (r,), with standard deviations of 1.

        Args:
            first: how far the size of the first segment usually is from 1.
            apart: how far the sizes of segments that hang on one another are apart.
            across: how far the factors of one segment are from their mean.
        """
        own = [k for k, part in enumerate(self.parts) if part.bodies == self.parts[0].bodies]
        rows = [
            self._mean(own, first),
            *((self._mean(one, apart) - self._mean(two, apart)) for one, two in self.alike),
        ]
        rows += [self._mean((k,), across) - self._mean(own, across) for k, own in self.sides]
        wanted = np.zeros(len(rows))
        wanted[0] = 1.0 / first
        return np.array(rows), wanted

    def _mean(self, numbers: Sequence[int], deviation: float) -> Array:
        row = np.zeros(len(self.parts))
        row[list(numbers)] = 1.0 / len(numbers) / deviation
        return row


def other_side(name: str, names: Mapping[str, object]) -> str:
    """The name of what is on the other side, if there is any: ``femur_l`` for ``femur_r``; or the same name."""

    def swapped(found: re.Match[str]) -> str:
        word = SIDES[found[0].lower()]
        return (
            word.upper()
            if found[0].isupper()
            else word.capitalize()
            if found[0][0].isupper()
            else word
        )

    other = _SIDE.sub(swapped, name)
    return other if other in names else name
