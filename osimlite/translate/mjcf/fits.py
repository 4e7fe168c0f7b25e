"""Fits of tendons: wrap geoms are moved, turned and resized until the tendon matches the path."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from osimlite.base.records import replace
from osimlite.base.require import require
from osimlite.mechanics.multibody.spatial import Array, make_offset
from osimlite.translate.mjcf.routes import Router
from osimlite.translate.mjcf.tendons import Tendon, TendonSite, WrapGeom

ERROR_TOLERANCE_M = 1e-4
"""Error (m) of a tendon that needs no fit."""
MAX_ROUNDS = 4
"""Most rounds of a fit; each one searches numbers and then sides."""
WORTHWHILE_RATIO = 0.98
"""Ratio of the error after and before a round below which another round follows."""
SHIFT_SCALE_M = 0.01
"""Shift (m) that the search treats as one unit."""
TURN_SCALE_RAD = 0.1
"""Rotation (rad) that the search treats as one unit."""
LOG_RADIUS_SCALE = 0.1
"""Change of the logarithm of a radius that the search treats as one unit."""
SIDE_DIRECTIONS = 24
"""Number of directions around a surface that are tried for its side site."""

Residuals = Callable[[Tendon], Array]
"""Function that returns the residuals of a tendon with a piece replaced."""


def fit_tendon(router: Router, tendon: Tendon) -> Tendon:
    """Return the tendon with the smallest error near its present geometry.

    Its free wrap geoms and sites are moved.

    Points of the path stay where they are, and so do the small spheres that replace conditional
    points.

    Args:
        router: path with its poses.
        tendon: tendon to start from.
    """
    if router.compute_error(tendon) < ERROR_TOLERANCE_M:
        return tendon
    fixed_indices = [
        index for index, part in enumerate(tendon) if isinstance(part, TendonSite) and part.name
    ]
    # From the end, so that indices of earlier pieces remain valid.
    for first, last in reversed(list(pairwise(fixed_indices))):
        segment = tendon[first : last + 1]
        if any(map(_is_adjustable, segment)):
            result = _fit_piece(segment, router.make_piece_residuals(tendon, segment))
            tendon = (*tendon[:first], *result, *tendon[last + 1 :])
    return tendon


def _fit_piece(piece: Tendon, compute_residuals: Residuals) -> Tendon:
    """Fit a piece of a tendon.

    All numbers are fitted together by least squares, then the side of each surface, repeatedly.

    Returns:
        Piece with the smallest error; `piece` itself if no fit reduces the error.
    """
    search = require("scipy.optimize", extra="sim", purpose="fits of tendons").least_squares
    best = piece
    smallest_error = _compute_error(compute_residuals(piece))
    for _ in range(MAX_ROUNDS):
        start = best
        variable_count = sum(
            7 if isinstance(part, WrapGeom) else 3 for part in start if _is_adjustable(part)
        )
        guess = search(
            # Millimetres: tolerances of least_squares are for residuals near 1.
            lambda x, t=start: 1e3 * compute_residuals(_move_adjustable_parts(t, x)).ravel(),
            np.zeros(variable_count),
            max_nfev=40,
        )
        result = _choose_sides(_move_adjustable_parts(start, guess.x), compute_residuals)
        error = _compute_error(compute_residuals(result))
        if error < smallest_error:
            best = result
        if not error < WORTHWHILE_RATIO * smallest_error:
            break
        smallest_error = error
    return best


def _compute_error(residuals: Array) -> float:
    """Return the root of the summed mean squares of residuals (P, r)."""
    return float(np.sqrt(np.square(residuals).mean(0).sum()))


def _choose_sides(piece: Tendon, compute_residuals: Residuals) -> Tendon:
    """Return the piece with the best side for each surface."""
    angles = np.arange(SIDE_DIRECTIONS) * (2.0 * np.pi / SIDE_DIRECTIONS)
    directions = np.stack((np.cos(angles), np.sin(angles), 0.0 * angles), axis=1)
    # The length of a tendon jumps with the side, which no gradient shows: all sides are tried.
    for index, part in enumerate(piece):
        if isinstance(part, WrapGeom) and _is_adjustable(part):
            options = [
                (*piece[:index], part.replace_side(direction), *piece[index + 1 :])
                for direction in (None, *directions)
            ]
            piece = min(
                (piece, *options), key=lambda option: _compute_error(compute_residuals(option))
            )
    return piece


def _is_adjustable(part: TendonSite | WrapGeom) -> bool:
    """Return whether a fit may move a part: a surface without a sliding side site, or an unnamed site."""
    if isinstance(part, WrapGeom):
        return part.side is None or part.side.slides is None
    return not part.name


def _move_adjustable_parts(piece: Tendon, x: Array) -> Tendon:
    """Return the piece with its adjustable parts changed by the variables of the search."""
    parts: list[TendonSite | WrapGeom] = []
    for part in piece:
        if not _is_adjustable(part):
            parts.append(part)
        elif isinstance(part, TendonSite):
            parts.append(replace(part, position=part.position + SHIFT_SCALE_M * x[:3]))
            x = x[3:]
        else:
            frame = part.frame @ make_offset(SHIFT_SCALE_M * x[:3], TURN_SCALE_RAD * x[3:6])
            # A logarithm keeps the radius positive.
            radius = part.radius * float(np.exp(np.clip(LOG_RADIUS_SCALE * x[6], -5.0, 5.0)))
            parts.append(part.move_to(frame, radius))
            x = x[7:]
    return tuple(parts)
