"""Segments of a person: groups of bodies that share scale factors."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later
from osimlite.mechanics.multibody.spatial import Array

OPPOSITE_WORDS = {"r": "l", "l": "r", "right": "left", "left": "right"}
"""Words for one side of the body, and for the other."""
_SIDE_PATTERN = compile_later(r"right|left|(?<![a-z])[rl](?![a-z])", re.IGNORECASE)
"""Words and letters for a side in a name."""


class Segment(NamedTuple):
    """Bodies that have the same factors along some of their axes (0, 1, 2)."""

    bodies: tuple[str, ...]
    axes: tuple[int, ...]


class Segments(NamedTuple):
    """Parameters (k,) that determine the scale factors of all bodies."""

    parts: tuple[Segment, ...]  # segment of each parameter
    # Neighbouring segments: pairs of lists of parameters whose means are similar.
    neighbours: tuple[tuple[tuple[int, ...], tuple[int, ...]], ...]
    # Pairs of a parameter and the list of all parameters of its segment.
    sides: tuple[tuple[int, tuple[int, ...]], ...]

    @classmethod
    def group_bodies(
        cls, carriers: Mapping[str, str], marked: Collection[str], *, by_axis: bool, symmetric: bool
    ) -> Segments:
        """Return the segments into which the bodies of a model are grouped.

        A body without markers has the factors of the body with markers that it carries, as the
        talus those of the foot, or else of the body that carries it, as the patella, the toes and
        the hand.

        Args:
            carriers: parent of each body by name, parents first; bodies on ground have another
                name.
            marked: bodies with markers.
            by_axis: whether the factors of a body may differ between its axes.
            symmetric: whether both sides of the body have the same factors.
        """
        if symmetric:
            marked = {*marked, *(get_opposite_name(body, carriers) for body in marked)}
        group_names = {body: body for body in carriers}
        # From the outermost bodies inwards: a body without markers joins the one that it carries.
        for body, carrier in reversed(list(carriers.items())):
            if carrier in group_names and carrier not in marked and group_names[carrier] == carrier:
                group_names[carrier] = group_names[body] if group_names[body] in marked else carrier
        # From the root outwards: the remaining bodies join their parents.
        for body, carrier in carriers.items():
            if group_names[body] not in marked and carrier in group_names:
                group_names[body] = group_names[carrier]
        if symmetric:
            group_names = {
                body: min(first_body, get_opposite_name(first_body, carriers))
                for body, first_body in group_names.items()
            }
        groups = {
            name: tuple(body for body in carriers if group_names[body] == name)
            for name in group_names.values()
        }
        segments: list[Segment] = []
        indices_by_group: dict[str, tuple[int, ...]] = {}
        for name, bodies in groups.items():
            axes = ((0,), (1,), (2,)) if by_axis else ((0, 1, 2),)
            indices_by_group[name] = tuple(range(len(segments), len(segments) + len(axes)))
            segments += [Segment(bodies, selected) for selected in axes]
        neighbours = {
            (group_names[body], group_names[carrier])
            for body, carrier in carriers.items()
            if carrier in group_names
        }
        neighbour_indices = tuple(
            (indices_by_group[inner], indices_by_group[outer])
            for inner, outer in sorted(neighbours)
            if inner != outer
        )
        axis_pairs = tuple(
            (k, segment)
            for segment in indices_by_group.values()
            for k in segment
            if len(segment) > 1
        )
        return cls(tuple(segments), neighbour_indices, axis_pairs)

    def expand_factors(self, sizes: Sequence[float] | Array) -> dict[str, list[float]]:
        """Return the factors of each body along its axes for parameters (k,).

        Args:
            sizes: parameters (k,), the scale factors that segments share.

        Returns:
            Factors by name of the body.
        """
        result = {body: [1.0, 1.0, 1.0] for segment in self.parts for body in segment.bodies}
        for segment, size in zip(self.parts, sizes, strict=True):
            for body in segment.bodies:
                for axis in segment.axes:
                    result[body][axis] = float(size)
        return result

    def compute_prior(
        self, size_deviation: float, neighbour_deviation: float, axis_deviation: float
    ) -> tuple[Array, Array]:
        """Return the prior of the parameters as linear equations with standard deviation 1.

        Args:
            size_deviation: standard deviation of the first segment's size from 1.
            neighbour_deviation: standard deviation of the difference between neighbouring segments.
            axis_deviation: standard deviation of the factors of one segment from their mean.

        Returns:
            Matrix (r, k), and expected values of its product with the parameters (r,).
        """
        segment = [
            k for k, member in enumerate(self.parts) if member.bodies == self.parts[0].bodies
        ]
        rows = [
            self._create_mean_row(segment, size_deviation),
            *(
                (
                    self._create_mean_row(inner, neighbour_deviation)
                    - self._create_mean_row(outer, neighbour_deviation)
                )
                for inner, outer in self.neighbours
            ),
        ]
        rows += [
            self._create_mean_row((k,), axis_deviation)
            - self._create_mean_row(segment, axis_deviation)
            for k, segment in self.sides
        ]
        expected = np.zeros(len(rows))
        # The expected size of the first segment is 1; expected differences are 0.
        expected[0] = 1.0 / size_deviation
        return np.array(rows), expected

    def _create_mean_row(self, numbers: Sequence[int], deviation: float) -> Array:
        """Return a row that gives the mean of some parameters divided by a standard deviation."""
        row = np.zeros(len(self.parts))
        row[list(numbers)] = 1.0 / len(numbers) / deviation
        return row


def get_opposite_name(name: str, names: Mapping[str, object]) -> str:
    """Return the name of the same part on the other side, as ``femur_l`` for ``femur_r``.

    Args:
        name: name of the part.
        names: known names.

    Returns:
        The other name, or the same one if the other is unknown.
    """

    def swap_word(match: re.Match[str]) -> str:
        word = OPPOSITE_WORDS[match[0].lower()]
        return (
            word.upper()
            if match[0].isupper()
            else word.capitalize()
            if match[0][0].isupper()
            else word
        )

    opposite = _SIDE_PATTERN.sub(swap_word, name)
    return opposite if opposite in names else name
