"""A canvas for triangles in space, with a depth for every pixel: pictures without a display, a GPU or a browser."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from osimlite.base.named_tuples import NamedTuple
from osimlite.io.meshes.surface import Indices
from osimlite.mechanics.multibody.spatial import Array

_PORTION_PIXELS = 300_000
"""Number of pixels in one portion of work; more would exceed the caches of the processor."""


class Canvas:
    """Picture of `width` times `height` pixels, at first in the colour `background`.

    Positions are pixels to the right and down from the upper left corner. Of two points at one
    position, the point with the greater depth is nearer to the viewer.
    """

    def __init__(self, width: int, height: int, background: Array) -> None:
        self.width, self.height = width, height
        # float32 suffices for colours; depths stay double, since they decide what hides what.
        self._colors = np.empty((width * height, 3), dtype=np.float32)
        self._colors[:] = background
        # The background is infinitely far away.
        self._depths = np.full(width * height, -np.inf)

    def draw_opaque(self, vertices: Array, colors: Array) -> None:
        """Draw opaque triangles.

        Args:
            vertices: position (pixels) and depth of the corners of each triangle (t, 3, 3).
            colors: red, green and blue of the corners (t, 3, 3), 0 to 1.
        """
        for spans in self._iterate_spans(vertices):
            pixels, span_indices, steps = spans.to_pixels()
            # 1. The depth of each pixel becomes the largest of all triangles.
            depths = spans.values(vertices[:, :, 2], span_indices, steps)
            np.maximum.at(self._depths, pixels, depths)
            # 2. The triangle with this depth gives the colour.
            visible = np.flatnonzero(depths == self._depths[pixels])
            self._colors[pixels[visible]] = spans.values(
                colors, span_indices[visible], steps[visible, None]
            )

    def draw_translucent(self, vertices: Array, colors: Array, opacities: Array) -> None:
        """Draw translucent triangles. Call it once, after all opaque ones.

        Args:
            vertices: position (pixels) and depth of the corners of each triangle (t, 3, 3).
            colors: red, green and blue of the corners (t, 3, 3), 0 to 1.
            opacities: opacity of each triangle (t,), 0 to 1.
        """
        portions: list[tuple[Indices, Array, Array, Array]] = []
        for spans in self._iterate_spans(vertices):
            pixels, span_indices, steps = spans.to_pixels()
            depths = spans.values(vertices[:, :, 2], span_indices, steps)
            # Only what is in front of the opaque triangles shows.
            visible = np.flatnonzero(depths > self._depths[pixels])
            shades = spans.values(colors, span_indices[visible], steps[visible, None])
            portions.append(
                (
                    pixels[visible],
                    depths[visible],
                    shades,
                    opacities[spans.triangles[span_indices[visible]]],
                )
            )
        if not portions:
            return
        pixels, depths, shades, alphas = (
            np.concatenate(column) for column in zip(*portions, strict=True)
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
            has_rank = ranks == rank
            alpha = alphas[has_rank, None]
            self._colors[pixels[has_rank]] = (1.0 - alpha) * self._colors[
                pixels[has_rank]
            ] + alpha * shades[has_rank]

    def to_pixels(self, scale: int = 1) -> NDArray[np.uint8]:
        """Return the picture (height, width, 3), averaged over squares of `scale`² pixels."""
        blocks = self._colors.reshape(self.height // scale, scale, self.width // scale, scale, 3)
        # One after the other: numpy takes several times as long for the mean over axes that short.
        colors = np.zeros_like(blocks[:, 0, :, 0])
        for row, column in np.ndindex(scale, scale):
            colors += blocks[:, row, :, column]
        result: NDArray[np.uint8] = (
            np.rint(255.0 / scale**2 * colors).clip(0.0, 255.0).astype(np.uint8)
        )
        return result

    def _iterate_spans(self, vertices: Array) -> Iterator[_Spans]:
        """Yield the pixels whose centres triangles cover, in portions: row by row, from edge to edge."""
        in_picture = vertices[:, :, :2]
        # Degenerate corners give NaN, which the next lines leave out.
        with np.errstate(all="ignore"):
            lower, upper = in_picture.min(axis=1), in_picture.max(axis=1)
            # Triangles outside of the picture cover no pixel.
            overlaps = (upper > 0.0).all(axis=1) & (lower < (self.width, self.height)).all(axis=1)
        candidates = np.flatnonzero(overlaps & np.isfinite(vertices).all(axis=(1, 2)))
        # A row is covered if its centre is between the ends of the triangle.
        top = np.ceil(lower[candidates, 1] - 0.5).clip(0, self.height).astype(np.int64)
        bottom = np.floor(upper[candidates, 1] - 0.5).clip(-1, self.height - 1).astype(np.int64)
        candidate_indices, rows = _enumerate_ranges(top, bottom - top + 1)
        triangles = candidates[candidate_indices]
        starts, ends = self._find_row_ends(in_picture[triangles], _pixel_centres(rows))
        covered = np.flatnonzero(starts <= ends)
        triangles, rows, starts, lengths = (
            triangles[covered],
            rows[covered],
            starts[covered],
            (ends - starts + 1)[covered],
        )
        total = np.cumsum(lengths)
        # Portions of limited size, cut between rows.
        cuts = np.searchsorted(
            total, np.arange(_PORTION_PIXELS, total[-1] if len(total) else 0, _PORTION_PIXELS)
        )
        for portion in np.split(np.arange(len(rows)), cuts):
            triangle, row, start = triangles[portion], rows[portion], starts[portion]
            weights = _compute_weights(
                in_picture[triangle], _pixel_centres(start), _pixel_centres(row)
            )
            yield _Spans(triangle, row * self.width + start, lengths[portion], *weights)

    def _find_row_ends(self, corners: Array, y: Array) -> tuple[Indices, Indices]:
        """Return the first and last pixel that triangles (r, 3, 2) cover at heights (r,)."""
        left, right = np.full(len(y), np.inf), np.full(len(y), -np.inf)
        # Each edge that crosses the height of the row limits the span.
        for first_corner, second_corner in ((0, 1), (1, 2), (2, 0)):
            (ax, ay), (bx, by) = corners[:, first_corner].T, corners[:, second_corner].T
            with np.errstate(all="ignore"):
                fraction = (y - ay) / (by - ay)
                x = ax + fraction * (bx - ax)
                # A horizontal edge gives NaN, whose comparisons are false.
                crosses = (fraction >= 0.0) & (fraction <= 1.0)
            np.minimum(left, x, out=left, where=crosses)
            np.maximum(right, x, out=right, where=crosses)
        # Pixels count if their centres are inside.
        start = np.ceil(left - 0.5).clip(0, self.width).astype(np.int64)
        return start, np.floor(right - 0.5).clip(-1, self.width - 1).astype(np.int64)


class _Spans(NamedTuple):
    """Horizontal spans of pixels, each covered by one triangle."""

    triangles: Indices  # index of the triangle of each span (s,)
    starts: Indices  # number of the first pixel (s,)
    lengths: Indices  # number of pixels (s,)
    weights: Array  # weights of the triangle's corners at the first pixel's centre (s, 3)
    changes: Array  # changes of the weights from one pixel to the next (s, 3)

    def to_pixels(self) -> tuple[Indices, Indices, Indices]:
        """Return all pixels of the spans.

        Returns:
            Pixel numbers (k,), index of the span of each, and its offset in the span.
        """
        span_indices, steps = _enumerate_ranges(np.zeros_like(self.lengths), self.lengths)
        return self.starts[span_indices] + steps, span_indices, steps

    def values(self, corners: Array, span_indices: Indices, steps: Indices) -> Array:
        """Interpolate values (t, 3, ...) at the corners of triangles linearly at pixels.

        Args:
            corners: values at the corners of all triangles (t, 3, ...).
            span_indices: index of the span of each pixel (k,).
            steps: offset of each pixel in its span (k,).

        Returns:
            Values at the pixels (k, ...).
        """
        span_corners = corners[self.triangles]
        first, change = (
            np.einsum("sc,sc...->s...", weights, span_corners)
            for weights in (self.weights, self.changes)
        )
        result: Array = first[span_indices] + change[span_indices] * steps
        return result


def _pixel_centres(numbers: Indices) -> Array:
    """Return the coordinates of the centres of pixels."""
    return numbers.astype(np.float64) + 0.5


def _enumerate_ranges(starts: Indices, counts: Indices) -> tuple[Indices, Indices]:
    """Return every integer of ranges (starts and lengths (r,)), after the index of its range."""
    counts = counts.clip(0)
    range_indices = np.repeat(np.arange(len(counts)), counts)
    offsets = np.cumsum(counts) - counts
    return range_indices, np.arange(len(range_indices)) + (starts - offsets)[range_indices]


def _compute_weights(corners: Array, x: Array, y: Array) -> tuple[Array, Array]:
    """Return weights (k, 3) of corners (k, 3, 2) at points, and their derivatives along x."""
    # Barycentric coordinates: areas of partial triangles over the whole.
    (ax, ay), (bx, by), (cx, cy) = (corners[:, index].T for index in range(3))
    with np.errstate(all="ignore"):
        size = 1.0 / ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))
        first = ((bx - x) * (cy - y) - (by - y) * (cx - x)) * size
        second = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) * size
        result = np.stack((first, second, 1.0 - first - second), axis=1)
        change = np.stack(((by - cy) * size, (cy - ay) * size, (ay - by) * size), axis=1)
    # A triangle seen from its edge covers pixels without a middle.
    is_finite = np.isfinite(result).all(axis=1, keepdims=True) & np.isfinite(change).all(
        axis=1, keepdims=True
    )
    return np.where(is_finite, result, 1.0 / 3.0), np.where(is_finite, change, 0.0)
