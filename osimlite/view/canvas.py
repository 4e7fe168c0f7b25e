"""A canvas for triangles in space, with a depth for every pixel: pictures without a display, a GPU or a browser."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from osimlite.multibody.spatial import Array
from osimlite.translate.surface import Indices

_AT_ONCE = 2_000_000
"""How many pixels are worked on in one step; more would take much memory."""

Fragments = tuple[Indices, Indices, Array]
"""Pixels (k,), triangles (k,) and the weights (k, 3) of the triangles' corners at the pixels' centres."""


class Canvas:
    """A picture of `width` times `height` pixels in one colour, to draw on.

    Positions are pixels to the right and down from the upper left corner; of two points at one place, that with the
    greater depth is nearer to the viewer.
    """

    def __init__(self, width: int, height: int, background: Array) -> None:
        self.width, self.height = width, height
        self._colors = np.empty((width * height, 3), dtype=np.float32)
        self._colors[:] = background
        self._depths = np.full(width * height, -np.inf)

    def solid(self, places: Array, colors: Array) -> None:
        """Draw triangles.

        Args:
            places: position and depth of their corners (t, 3, 3).
            colors: of their corners (t, 3, 3), 0 to 1.
        """
        for pixels, triangles, weights in self._fragments(places):
            depths = np.einsum("kc,kc->k", weights, places[triangles, :, 2])
            np.maximum.at(self._depths, pixels, depths)
            seen = depths == self._depths[pixels]
            pixels, triangles, weights = pixels[seen], triangles[seen], weights[seen]
            self._colors[pixels] = np.einsum("kc,kcd->kd", weights, colors[triangles])

    def glassy(self, places: Array, colors: Array, opacities: Array) -> None:
        """Draw triangles that let shine through what is behind them; to be called once, after all solid ones.

        Args:
            places: as in :meth:`solid`.
            colors: as in :meth:`solid`.
            opacities: of the triangles (t,), 0 to 1.
        """
        parts: list[tuple[Indices, Array, Array, Array]] = []
        for pixels, triangles, weights in self._fragments(places):
            depths = np.einsum("kc,kc->k", weights, places[triangles, :, 2])
            seen = depths > self._depths[pixels]
            pixels, triangles, weights = pixels[seen], triangles[seen], weights[seen]
            shades = np.einsum("kc,kcd->kd", weights, colors[triangles])
            parts.append((pixels, depths[seen], shades, opacities[triangles]))
        if not parts:
            return
        pixels, depths, shades, alphas = (np.concatenate(column) for column in zip(*parts, strict=True))
        order = np.lexsort((depths, pixels))
        pixels, shades, alphas = pixels[order], shades[order], alphas[order]
        starts = np.flatnonzero(np.append(True, np.diff(pixels) != 0)) if len(pixels) else np.zeros(0, dtype=int)
        ranks = np.arange(len(pixels)) - np.repeat(starts, np.diff(np.append(starts, len(pixels))))
        for rank in range(int(ranks.max(initial=-1)) + 1):
            now = ranks == rank
            alpha = alphas[now, None]
            self._colors[pixels[now]] = (1.0 - alpha) * self._colors[pixels[now]] + alpha * shades[now]

    def pixels(self, fine: int = 1) -> NDArray[np.uint8]:
        """The picture (height, width, 3), every `fine` times `fine` pixels made one."""
        shape = self.height // fine, fine, self.width // fine, fine, 3
        colors = self._colors.reshape(shape).mean(axis=(1, 3))
        found: NDArray[np.uint8] = np.rint(255.0 * np.clip(colors, 0.0, 1.0)).astype(np.uint8)
        return found

    def _fragments(self, places: Array) -> Iterator[Fragments]:
        """The pixels whose centres triangles cover, in portions: row by row, from edge to edge."""
        flat = places[:, :, :2]
        with np.errstate(all="ignore"):
            low, high = flat.min(axis=1), flat.max(axis=1)
            wanted = (high > 0.0).all(axis=1) & (low < (self.width, self.height)).all(axis=1)
        chosen = np.flatnonzero(wanted & np.isfinite(places).all(axis=(1, 2)))
        top = np.ceil(low[chosen, 1] - 0.5).clip(0, self.height).astype(np.int64)
        bottom = np.floor(high[chosen, 1] - 0.5).clip(-1, self.height - 1).astype(np.int64)
        which, rows = _counted(top, bottom - top + 1)
        triangles = chosen[which]
        starts, ends = self._spans(flat[triangles], _middle(rows))
        lengths = (ends - starts + 1).clip(0)
        total = np.cumsum(lengths)
        cuts = np.searchsorted(total, np.arange(_AT_ONCE, total[-1] if len(total) else 0, _AT_ONCE))
        for part in np.split(np.arange(len(rows)), cuts):
            span, columns = _counted(starts[part], lengths[part])
            row, triangle = rows[part][span], triangles[part][span]
            yield row * self.width + columns, triangle, _weights(flat[triangle], _middle(columns), _middle(row))

    def _spans(self, corners: Array, y: Array) -> tuple[Indices, Indices]:
        """The first and the last pixel of a row that triangles cover, given corners (r, 3, 2) and heights (r,)."""
        others = corners[:, (1, 2, 0)]
        with np.errstate(all="ignore"):
            along = (y[:, None] - corners[:, :, 1]) / (others[:, :, 1] - corners[:, :, 1])
            x = corners[:, :, 0] + along * (others[:, :, 0] - corners[:, :, 0])
            met = (along >= 0.0) & (along <= 1.0)
        left = np.where(met, x, np.inf).min(axis=1)
        right = np.where(met, x, -np.inf).max(axis=1)
        start = np.ceil(left - 0.5).clip(0, self.width).astype(np.int64)
        return start, np.floor(right - 0.5).clip(-1, self.width - 1).astype(np.int64)


def _middle(numbers: Indices) -> Array:
    """Where the middles of pixels are."""
    return numbers.astype(np.float64) + 0.5


def _counted(starts: Indices, counts: Indices) -> tuple[Indices, Indices]:
    """For ranges of whole numbers, given their starts and lengths (r,): for every number its range, and the number."""
    counts = counts.clip(0)
    which = np.repeat(np.arange(len(counts)), counts)
    before = np.cumsum(counts) - counts
    return which, np.arange(len(which)) - before[which] + starts[which]


def _weights(corners: Array, x: Array, y: Array) -> Array:
    """The weights (k, 3) of the corners (k, 3, 2) of triangles at points in them."""
    (ax, ay), (bx, by), (cx, cy) = (corners[:, place].T for place in range(3))
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    with np.errstate(all="ignore"):
        first = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area
        second = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area
    found = np.stack((first, second, 1.0 - first - second), axis=1)
    # A triangle seen from its edge covers pixels without a middle.
    return np.where(np.isfinite(found), found, 1.0 / 3.0)
