"""A canvas for triangles in space, with a depth for every pixel: pictures without a display, a GPU or a browser."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from osimlite.io.meshes.surface import Indices
from osimlite.mechanics.multibody.spatial import Array

_AT_ONCE = 300_000
"""How many pixels are worked on in one step; more would take more memory and leave the processor's caches."""


class Canvas:
    """A picture of `width` times `height` pixels in one colour, to draw on.

    Positions are pixels to the right and down from the upper left corner; of two points at one
    place, that with the greater depth is nearer to the viewer.
    """

    def __init__(self, width: int, height: int, background: Array) -> None:
        self.width, self.height = width, height
        self._colors = np.empty((width * height, 3), dtype=np.float32)
        # float32 suffices for colours; depths stay double, since they decide what hides what.
        self._colors[:] = background
        self._depths = np.full(width * height, -np.inf)

    # Nothing is drawn: infinitely far away.
    def draw_opaque(self, places: Array, colors: Array) -> None:
        """Draw triangles.

        Args:
            places: position and depth of their corners (t, 3, 3).
            colors: of their corners (t, 3, 3), 0 to 1.
        """
        for spans in self._iterate_spans(places):
            pixels, which, steps = spans.to_pixels()
            # 1. The depth of each pixel becomes the largest of all triangles.
            depths = spans.values(places[:, :, 2], which, steps)
            np.maximum.at(self._depths, pixels, depths)
            # 2. The triangle with this depth gives the colour.
            seen = np.flatnonzero(depths == self._depths[pixels])
            self._colors[pixels[seen]] = spans.values(colors, which[seen], steps[seen, None])

    def draw_translucent(self, places: Array, colors: Array, opacities: Array) -> None:
        """Draw triangles that let shine through what is behind them; to be called once, after all solid ones.

        Args:
            places: as in :meth:`draw_opaque`.
            colors: as in :meth:`draw_opaque`.
            opacities: of the triangles (t,), 0 to 1.
        """
        parts: list[tuple[Indices, Array, Array, Array]] = []
        for spans in self._iterate_spans(places):
            pixels, which, steps = spans.to_pixels()
            depths = spans.values(places[:, :, 2], which, steps)
            # Only what is in front of the opaque triangles shows.
            seen = np.flatnonzero(depths > self._depths[pixels])
            shades = spans.values(colors, which[seen], steps[seen, None])
            parts.append(
                (pixels[seen], depths[seen], shades, opacities[spans.triangles[which[seen]]])
            )
        if not parts:
            return
        pixels, depths, shades, alphas = (
            np.concatenate(column) for column in zip(*parts, strict=True)
        )
        # From the farthest to the nearest at each pixel.
        order = np.lexsort((depths, pixels))
        pixels, shades, alphas = pixels[order], shades[order], alphas[order]
        starts = (
            np.flatnonzero(np.append(True, np.diff(pixels) != 0))
            if len(pixels)
            else np.zeros(0, dtype=int)
        )
        # The rank of a triangle among those at its pixel; each pass blends one rank.
        ranks = np.arange(len(pixels)) - np.repeat(starts, np.diff(np.append(starts, len(pixels))))
        for rank in range(int(ranks.max(initial=-1)) + 1):
            now = ranks == rank
            alpha = alphas[now, None]
            self._colors[pixels[now]] = (1.0 - alpha) * self._colors[pixels[now]] + alpha * shades[
                now
            ]

    def to_pixels(self, fine: int = 1) -> NDArray[np.uint8]:
        """Return the picture (height, width, 3), every `fine` times `fine` pixels made one."""
        fields = self._colors.reshape(self.height // fine, fine, self.width // fine, fine, 3)
        # One after the other: numpy takes several times as long for the mean over axes that short.
        colors = np.zeros_like(fields[:, 0, :, 0])
        for row, column in np.ndindex(fine, fine):
            colors += fields[:, row, :, column]
        result: NDArray[np.uint8] = (
            np.rint(255.0 / fine**2 * colors).clip(0.0, 255.0).astype(np.uint8)
        )
        return result

    def _iterate_spans(self, places: Array) -> Iterator[_Spans]:
        """Yield the pixels whose centres triangles cover, in portions: row by row, from edge to edge."""
        flat = places[:, :, :2]
        # Degenerate corners give NaN, which the next lines leave out.
        with np.errstate(all="ignore"):
            low, high = flat.min(axis=1), flat.max(axis=1)
            # Triangles outside of the picture cover no pixel.
            wanted = (high > 0.0).all(axis=1) & (low < (self.width, self.height)).all(axis=1)
        chosen = np.flatnonzero(wanted & np.isfinite(places).all(axis=(1, 2)))
        # A row is covered if its centre is between the ends of the triangle.
        top = np.ceil(low[chosen, 1] - 0.5).clip(0, self.height).astype(np.int64)
        bottom = np.floor(high[chosen, 1] - 0.5).clip(-1, self.height - 1).astype(np.int64)
        which, rows = _enumerate_ranges(top, bottom - top + 1)
        triangles = chosen[which]
        starts, ends = self._find_row_ends(flat[triangles], _pixel_centres(rows))
        some = np.flatnonzero(starts <= ends)
        triangles, rows, starts, lengths = (
            triangles[some],
            rows[some],
            starts[some],
            (ends - starts + 1)[some],
        )
        total = np.cumsum(lengths)
        # Portions of limited size, cut between rows.
        cuts = np.searchsorted(total, np.arange(_AT_ONCE, total[-1] if len(total) else 0, _AT_ONCE))
        for part in np.split(np.arange(len(rows)), cuts):
            triangle, row, start = triangles[part], rows[part], starts[part]
            weights = _compute_weights(flat[triangle], _pixel_centres(start), _pixel_centres(row))
            yield _Spans(triangle, row * self.width + start, lengths[part], *weights)

    def _find_row_ends(self, corners: Array, y: Array) -> tuple[Indices, Indices]:
        """Return the first and the last pixel of a row that triangles cover, given corners (r, 3, 2) and heights (r,)."""
        left, right = np.full(len(y), np.inf), np.full(len(y), -np.inf)
        # Each edge that crosses the height of the row limits the span.
        for one, other in ((0, 1), (1, 2), (2, 0)):
            (ax, ay), (bx, by) = corners[:, one].T, corners[:, other].T
            with np.errstate(all="ignore"):
                along = (y - ay) / (by - ay)
                x = ax + along * (bx - ax)
                # A horizontal edge gives NaN, whose comparisons are false.
                met = (along >= 0.0) & (along <= 1.0)
            np.minimum(left, x, out=left, where=met)
            np.maximum(right, x, out=right, where=met)
        # Pixels count if their centres are inside.
        start = np.ceil(left - 0.5).clip(0, self.width).astype(np.int64)
        return start, np.floor(right - 0.5).clip(-1, self.width - 1).astype(np.int64)


class _Spans(NamedTuple):
    """Pixels side by side that a triangle covers."""

    triangles: Indices  # to which they belong (s,)
    starts: Indices  # number of the first pixel (s,)
    lengths: Indices  # how many pixels (s,)
    weights: Array  # of the triangle's corners at the first pixel's centre (s, 3)
    changes: Array  # of the weights from one pixel to the next (s, 3)

    def to_pixels(self) -> tuple[Indices, Indices, Indices]:
        """Return all pixels of the spans.

        Returns:
            Pixel numbers (k,), index of the span of each, and its offset in the span.
        """
        which, steps = _enumerate_ranges(np.zeros_like(self.lengths), self.lengths)
        return self.starts[which] + steps, which, steps

    def values(self, corners: Array, which: Indices, steps: Indices) -> Array:
        """Interpolate values (t, 3, ...) at the corners of triangles linearly at pixels.

        Args:
            corners: values at the corners of all triangles.
            which: index of the span of each pixel.
            steps: offset of each pixel in its span.
        """
        own = corners[self.triangles]
        first, change = (
            np.einsum("sc,sc...->s...", part, own) for part in (self.weights, self.changes)
        )
        result: Array = first[which] + change[which] * steps
        return result


def _pixel_centres(numbers: Indices) -> Array:
    """Return the coordinates of the centres of pixels."""
    return numbers.astype(np.float64) + 0.5


def _enumerate_ranges(starts: Indices, counts: Indices) -> tuple[Indices, Indices]:
    """Return for every integer of some ranges (starts and lengths (r,)) the index of its range, and the integer."""
    counts = counts.clip(0)
    which = np.repeat(np.arange(len(counts)), counts)
    before = np.cumsum(counts) - counts
    return which, np.arange(len(which)) + (starts - before)[which]


def _compute_weights(corners: Array, x: Array, y: Array) -> tuple[Array, Array]:
    """Return the weights (k, 3) of the corners (k, 3, 2) of triangles at points in them, and their derivatives along x."""
    # Barycentric coordinates: areas of partial triangles over the whole.
    (ax, ay), (bx, by), (cx, cy) = (corners[:, index].T for index in range(3))
    with np.errstate(all="ignore"):
        size = 1.0 / ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))
        first = ((bx - x) * (cy - y) - (by - y) * (cx - x)) * size
        second = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) * size
        result = np.stack((first, second, 1.0 - first - second), axis=1)
        change = np.stack(((by - cy) * size, (cy - ay) * size, (ay - by) * size), axis=1)
    # A triangle seen from its edge covers pixels without a middle.
    clear = np.isfinite(result).all(axis=1, keepdims=True) & np.isfinite(change).all(
        axis=1, keepdims=True
    )
    return np.where(clear, result, 1.0 / 3.0), np.where(clear, change, 0.0)
