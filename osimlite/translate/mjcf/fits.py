"""Fits: surfaces moved, turned and resized until a tendon does what the path does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from osimlite._require import require
from osimlite.multibody.spatial import Array, offset
from osimlite.translate.mjcf.routes import Router
from osimlite.translate.mjcf.tendons import Around, Spot, Tendon

SCALE = 0.01
"""Shifts (m), turns (by 10 of it, rad) and sizes are sought in these units."""
GOOD = 1e-4
"""An error (m) that need not become less."""
SIDES = 24


def fitted(router: Router, tendon: Tendon) -> Tendon:
    """The tendon with the surfaces and the free sites where its error is least, starting from where they are."""
    if router.error(tendon) < GOOD or not any(map(_is_free, tendon)):
        return tendon
    search = require("scipy.optimize", extra="sim", purpose="fits of tendons").least_squares
    best, least = tendon, router.error(tendon)
    for _ in range(4):
        start = best
        for loss in ("soft_l1", "linear"):
            guess = search(
                lambda x, t=start: 1e3 * router.residuals(_moved(t, x)).ravel(),
                np.zeros(_size(start)),
                loss=loss,
                max_nfev=40,
            )
            found = _moved(start, guess.x)
            found = _sided(router, found)
            if (error := router.error(found)) < least:
                best, least = found, error
        if best is start or least < GOOD:
            break
    return best


def _sided(router: Router, tendon: Tendon) -> Tendon:
    """The tendon with the best side for each surface."""
    for number, part in enumerate(tendon):
        if isinstance(part, Around) and _is_free(part):
            turns = np.arange(SIDES) * (2.0 * np.pi / SIDES)
            sides = np.stack((np.cos(turns), np.sin(turns), 0.0 * turns), axis=1)
            options = [(*tendon[:number], part.sided(side), *tendon[number + 1 :]) for side in sides]
            options.append(tendon)
            tendon = min(options, key=router.error)
    return tendon


def _is_free(part: Spot | Around) -> bool:
    if isinstance(part, Around):
        return part.side is None or part.side.slides is None
    return not part.name


def _size(tendon: Tendon) -> int:
    return sum(7 if isinstance(part, Around) else 3 for part in tendon if _is_free(part))


def _moved(tendon: Tendon, x: Array) -> Tendon:
    """The tendon with its free parts moved by numbers of the fit."""
    parts: list[Spot | Around] = []
    for part in tendon:
        if not _is_free(part):
            parts.append(part)
        elif isinstance(part, Around):
            shift, turn, size = SCALE * x[:3], 10.0 * SCALE * x[3:6], x[6]
            moved = replace(
                part,
                frame=part.frame @ offset(shift, turn),
                radius=part.radius * float(np.exp(10.0 * SCALE * np.clip(size, -50, 50))),
            )
            if part.side is not None:
                moved = moved.sided(part.frame[:3, :3].T @ (part.side.place - part.frame[:3, 3]))
            parts.append(moved)
            x = x[7:]
        else:
            parts.append(replace(part, place=part.place + SCALE * x[:3]))
            x = x[3:]
    return tuple(parts)
