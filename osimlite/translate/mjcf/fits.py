"""Fits: surfaces moved, turned and resized until a tendon does what the path does."""

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
"""An error (m) that need not become less."""
MAX_ROUNDS, WORTHWHILE_RATIO = 4, 0.98
"""At most so many rounds, as long as the error falls below this part of what it was."""
SHIFT_SCALE_M, TURN_SCALE_RAD, LOG_RADIUS_SCALE = 0.01, 0.1, 0.1
"""What the search takes for equally large: shifts (m), turns (rad), logarithms of radii."""
SIDE_DIRECTIONS = 24
"""So many directions around a surface are tried as sides."""

Residuals = Callable[[Tendon], Array]
"""The residuals of a tendon with a piece of it."""


def fit_tendon(router: Router, tendon: Tendon) -> Tendon:
    """The tendon with surfaces and sites of ours where its error is least, sought from where they are.

    Points of the path stay where they are, and so do specks that stand for such points.
    """
    if router.compute_error(tendon) < ERROR_TOLERANCE_M:
        return tendon
    fixed = [
        index for index, part in enumerate(tendon) if isinstance(part, TendonSite) and part.name
    ]
    for first, last in reversed(list(pairwise(fixed))):
        piece = tendon[first : last + 1]
        if any(map(_is_free, piece)):
            result = _fit_piece(piece, router.make_piece_residuals(tendon, piece))
            tendon = (*tendon[:first], *result, *tendon[last + 1 :])
    return tendon


def _fit_piece(piece: Tendon, wrong: Residuals) -> Tendon:
    """The piece with the least error: all numbers are sought together, then the side of each surface, in turn."""
    search = require("scipy.optimize", extra="sim", purpose="fits of tendons").least_squares
    best, least = piece, _compute_error(wrong(piece))
    for _ in range(MAX_ROUNDS):
        start = best
        size = sum(7 if isinstance(part, WrapGeom) else 3 for part in start if _is_free(part))
        guess = search(
            lambda x, t=start: 1e3 * wrong(_move_free_parts(t, x)).ravel(),
            np.zeros(size),
            max_nfev=40,
        )
        result = _choose_sides(_move_free_parts(start, guess.x), wrong)
        error = _compute_error(wrong(result))
        if error < least:
            best = result
        if not error < WORTHWHILE_RATIO * least:
            break
        least = error
    return best


def _compute_error(residuals: Array) -> float:
    return float(np.sqrt(np.square(residuals).mean(0).sum()))


def _choose_sides(piece: Tendon, wrong: Residuals) -> Tendon:
    """The piece with the best side for each surface."""
    turns = np.arange(SIDE_DIRECTIONS) * (2.0 * np.pi / SIDE_DIRECTIONS)
    directions = np.stack((np.cos(turns), np.sin(turns), 0.0 * turns), axis=1)
    for index, part in enumerate(piece):
        if isinstance(part, WrapGeom) and _is_free(part):
            options = [
                (*piece[:index], part.replace_side(way), *piece[index + 1 :])
                for way in (None, *directions)
            ]
            piece = min((piece, *options), key=lambda option: _compute_error(wrong(option)))
    return piece


def _is_free(part: TendonSite | WrapGeom) -> bool:
    if isinstance(part, WrapGeom):
        return part.side is None or part.side.slides is None
    return not part.name


def _move_free_parts(piece: Tendon, x: Array) -> Tendon:
    """The piece with its free parts moved by numbers of the search."""
    parts: list[TendonSite | WrapGeom] = []
    for part in piece:
        if not _is_free(part):
            parts.append(part)
        elif isinstance(part, TendonSite):
            parts.append(replace(part, place=part.place + SHIFT_SCALE_M * x[:3]))
            x = x[3:]
        else:
            frame = part.frame @ make_offset(SHIFT_SCALE_M * x[:3], TURN_SCALE_RAD * x[3:6])
            radius = part.radius * float(np.exp(np.clip(LOG_RADIUS_SCALE * x[6], -5.0, 5.0)))
            parts.append(part.move_to(frame, radius))
            x = x[7:]
    return tuple(parts)
