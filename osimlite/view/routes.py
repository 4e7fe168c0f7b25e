"""Paths for the page: their layout as data, and the kernels that compute them as JavaScript."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from typing import Any

import numpy as np

from osimlite.backends.javascript import as_javascript
from osimlite.kernels.layout import ITEM, LINK_WORK
from osimlite.kernels.paths import pull_path
from osimlite.simulation.elements.laws import law_function
from osimlite.simulation.polylines import Polylines


def routes_data(paths: Polylines) -> dict[str, Any] | None:
    """The paths as the kernels take them, and what the page must know of their layout."""
    if not paths.items:
        return None
    return {
        "structure": text_of(paths.structure.astype("<i4")),
        "numbers": text_of(paths.numbers.astype("<f8")),
        "laws": paths.laws[1:],
        "items": paths.items,
        "traces": paths.traces,
        "room": paths.room,
        "work": paths.work,
        "layout": {
            "link": LINK_WORK.SIZE,
            "position": LINK_WORK.POSITION,
            "wrench": LINK_WORK.WRENCH,
            "law": ITEM.LAW,
            "record": ITEM.RECORD,
        },
    }


def kernels_text(routes: Mapping[str, Any] | None) -> str:
    """What the page computes paths with."""
    if routes is None:
        return "window.osimlite = {};\n"
    kernels = as_javascript([law_function(name) for name in routes["laws"]], [pull_path])
    return f"window.osimlite = {{ kernels: {kernels} }};\n"


def text_of(array: Any) -> str:
    """The numbers of an array as text (base64), in their order."""
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")
