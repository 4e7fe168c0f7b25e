"""Fits: surfaces moved, turned and resized until a tendon does what the path does."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from osimlite.base.records import replace
from osimlite.base.require import require
from osimlite.mechanics.multibody.spatial import Array, make_offset
from osimlite.translate.mjcf.routes import Router
from osimlite.translate.mjcf.tendons import Around, Spot, Tendon

GOOD = 1e-4
"""An error (m) that need not become less."""
ROUNDS, WORTH = 4, 0.98
"""At most so many rounds, as long as the error falls below this part of what it was."""
SHIFT, TURN, GROW = 0.01, 0.1, 0.1
"""What the search takes for equally large: shifts (m), turns (rad), logarithms of radii."""
SIDES = 24
"""So many directions around a surface are tried as sides."""

Wrong = Callable[[Tendon], Array]
"""The residuals of a tendon with a piece of it."""


def fit_tendon(router: Router, tendon: Tendon) -> Tendon:
    """The tendon with surfaces and sites of ours where its error is least, sought from where they are.

    Points of the path stay where they are, and so do specks that stand for such points.
    """
    if router.error(tendon) < GOOD:
        return tendon
    fixed = [index for index, part in enumerate(tendon) if isinstance(part, Spot) and part.name]
    for first, last in reversed(list(pairwise(fixed))):
        piece = tendon[first : last + 1]
        if any(map(_is_free, piece)):
            result = _search(piece, router.but_for(tendon, piece))
            tendon = (*tendon[:first], *result, *tendon[last + 1 :])
    return tendon


def _search(piece: Tendon, wrong: Wrong) -> Tendon:
    """The piece with the least error: all numbers are sought together, then the side of each surface, in turn."""
    search = require("scipy.optimize", extra="sim", purpose="fits of tendons").least_squares
    best, least = piece, _error(wrong(piece))
    for _ in range(ROUNDS):
        start = best
        size = sum(7 if isinstance(part, Around) else 3 for part in start if _is_free(part))
        guess = search(
            lambda x, t=start: 1e3 * wrong(_move_free_parts(t, x)).ravel(),
            np.zeros(size),
            max_nfev=40,
        )
        result = _choose_sides(_move_free_parts(start, guess.x), wrong)
        error = _error(wrong(result))
        if error < least:
            best = result
        if not error < WORTH * least:
            break
        least = error
    return best


def _error(residuals: Array) -> float:
    return float(np.sqrt(np.square(residuals).mean(0).sum()))


def _choose_sides(piece: Tendon, wrong: Wrong) -> Tendon:
    """The piece with the best side for each surface."""
    turns = np.arange(SIDES) * (2.0 * np.pi / SIDES)
    directions = np.stack((np.cos(turns), np.sin(turns), 0.0 * turns), axis=1)
    for index, part in enumerate(piece):
        if isinstance(part, Around) and _is_free(part):
            options = [
                (*piece[:index], part.with_side(way), *piece[index + 1 :])
                for way in (None, *directions)
            ]
            piece = min((piece, *options), key=lambda option: _error(wrong(option)))
    return piece


def _is_free(part: Spot | Around) -> bool:
    if isinstance(part, Around):
        return part.side is None or part.side.slides is None
    return not part.name


def _move_free_parts(piece: Tendon, x: Array) -> Tendon:
    """The piece with its free parts moved by numbers of the search."""
    parts: list[Spot | Around] = []
    for part in piece:
        if not _is_free(part):
            parts.append(part)
        elif isinstance(part, Spot):
            parts.append(replace(part, place=part.place + SHIFT * x[:3]))
            x = x[3:]
        else:
            frame = part.frame @ make_offset(SHIFT * x[:3], TURN * x[3:6])
            radius = part.radius * float(np.exp(np.clip(GROW * x[6], -5.0, 5.0)))
            parts.append(part.move_to(frame, radius))
            x = x[7:]
    return tuple(parts)
