"""Data and JavaScript kernels with which the page computes poses, paths and moment arms."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from osimlite.mechanics.codegen.javascript import write_javascript
from osimlite.mechanics.kernels.constrained_dynamics import evaluate_constraints
from osimlite.mechanics.kernels.dynamics import add_generalized_forces, clear_wrenches
from osimlite.mechanics.kernels.layout import CONSTRAINED, ITEM, LINK_WORK, MODEL
from osimlite.mechanics.kernels.motion import move_links, place_links
from osimlite.mechanics.kernels.paths import pull_path
from osimlite.mechanics.kernels.projection import project_speeds
from osimlite.mechanics.multibody.constraints import ConstraintEquations, Coupler
from osimlite.simulation.elements.laws import find_function
from osimlite.simulation.polylines import Polylines
from osimlite.view.tubes import MORE_RINGS, RING, TENDON, lay_tube

FOR_ARMS = (move_links, clear_wrenches, pull_path, add_generalized_forces)
"""Kernels that compute the moment arms of paths."""

FOR_SPEEDS = (evaluate_constraints, project_speeds)
"""Kernels that compute the speeds of coordinates that are coupled to another."""


def program_data(paths: Polylines, constraints: Sequence[ConstraintEquations]) -> dict[str, Any]:
    """Return the input of the JavaScript kernels and the layout of their vectors.

    Returns:
        Plain data for JSON; arrays of numbers are base64 text in little-endian order.
    """
    program, structure = paths.program, paths.structure
    constrained_record = structure[structure[MODEL.CONSTRAINED] :]
    records = structure[constrained_record[CONSTRAINED.CONSTRAINT_AT] :]
    errors = constrained_record[CONSTRAINED.WORK_ERRORS]
    # Each row: the record of the constraint, the dependent degree of freedom, the offset of the
    # error.
    coupled = [
        (
            records[program.constraints[id(constraint)]],
            program.freedoms[constraint.dependent],
            errors + program.equations_of(constraint)[0],
        )
        for constraint in constraints
        if isinstance(constraint, Coupler)
    ]
    return {
        # Each row: the link of a body (the last row is ground), and the body's frame in the link by
        # rows.
        "bodies": [
            *zip(
                program.links.tolist(), program.frames[:, :3].reshape(-1, 12).tolist(), strict=True
            )
        ],
        "structure": text_of(structure.astype("<i4")),
        "numbers": text_of(paths.numbers.astype("<f8")),
        "laws": paths.laws[1:],
        "items": paths.items,
        "traces": paths.traces,
        "most_corners": paths.most_corners,
        "work": paths.work,
        "order": program.order,
        "couplers": [list(map(int, record)) for record in coupled],
        "bound": paths.bound,
        "layout": {
            "links": int(structure[MODEL.WORK_LINK]),
            "link": LINK_WORK.SIZE,
            "position": LINK_WORK.POSITION,
            "laws": MODEL.LAWS,
            "law": ITEM.LAW,
            "record": ITEM.RECORD,
        },
        "tubes": {
            "tendon": TENDON,
            "more": MORE_RINGS,
            "size": RING.SIZE,
            "center": RING.CENTER,
            "along": RING.ALONG,
            "across": RING.ACROSS,
            "radius": RING.RADIUS,
            "fibers": RING.FIBERS,
        },
    }


def kernels_text(program: Mapping[str, Any]) -> str:
    """Return the JavaScript source of the kernels that the page needs."""
    laws = [find_function(name) for name in program["laws"]]
    functions = [
        place_links,
        lay_tube,
        *(FOR_ARMS if program["items"] else ()),
        *(FOR_SPEEDS if program["bound"] else ()),
    ]
    kernels = write_javascript(laws, functions)
    return f"window.osimlite = {{ kernels: {kernels} }};\n"


def text_of(array: Any) -> str:
    """Return the bytes of an array as base64 text, in the order of its elements."""
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")
