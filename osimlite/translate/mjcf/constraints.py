"""Constraints between bodies."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from osimlite.mechanics.multibody import body_constraints as b
from osimlite.translate.fidelity import LEFT_OUT
from osimlite.translate.mjcf.draft import SPECK_MASS_KG, MjcfDraft, add_element
from osimlite.translate.mjcf.frame_forces import add_straight_tendon


def add_constraints(draft: MjcfDraft) -> None:
    """Add every constraint between bodies.

    Constraints between coordinates are equalities of joints, see `couplings`.
    """
    for constraint in draft.mechanism.constraints:
        if constraint.bodies:
            make = _MAKERS.get(type(constraint))
            if make is None:
                what = f"a {type(constraint).__name__}"
                draft.fidelity.add(
                    "constraint", constraint.name, what, f"{LEFT_OUT}: MuJoCo has none"
                )
            else:
                draft.fidelity.translated[constraint.name] = make(draft, constraint)


def _add_site_equality(
    kind: str, draft: MjcfDraft, item: b.WeldEquations | b.PointEquations
) -> str:
    """Add an equality of a kind ("weld" or "connect") between two sites."""
    name = draft.make_name("equality", item.name)
    sites = [draft.add_site(item.name, *end) for end in (item.first, item.second)]
    add_element(draft.get_section("equality"), kind, name=name, site1=sites[0], site2=sites[1])
    return f"equality {name}"


def _add_distance(draft: MjcfDraft, item: b.DistanceConstraint) -> str:
    """Add a tendon of constant length; MuJoCo measures from its length with all joints at zero."""
    name = add_straight_tendon(
        draft, item.name, [draft.add_site(item.name, *end) for end in (item.first, item.second)]
    )
    length = float(
        np.linalg.norm(draft.locate_at_zero(item.first) - draft.locate_at_zero(item.second))
    )
    add_element(
        draft.get_section("equality"),
        "tendon",
        name=name,
        # MuJoCo's tendon equalities are about changes from the length at qpos0.
        tendon1=name,
        # The equality sets the change of length from the reference length.
        polycoef=[item.distance - length, 0, 0, 0, 0],
    )
    return f"equality {name}"


def _add_point_on_line(draft: MjcfDraft, item: b.PointOnLineEquations) -> str:
    """Add a light body that slides along the line, and connect it to the follower.

    MuJoCo has no constraint of a point to a line.
    """
    name = draft.make_name("joint", item.name)
    frame = np.eye(4)
    # The frame has the axes of the body, in which the line is given.
    frame[:3, 3] = item.line.location
    speck = draft.add_speck(name, draft.bodies[item.line.body], frame)
    add_element(speck, "joint", name=name, type="slide", axis=item.along)
    state = draft.mechanism.at(draft.default_state[0])
    arm = state.point(*item.follower) - state.point(*item.line)
    # The slide starts at the projection of the follower on the line.
    draft.starts[name] = float(arm @ state.transform(item.line.body)[:3, :3] @ item.along)
    draft.fidelity.add(
        "constraint",
        item.name,
        "a point that stays on a line",
        f"connected to a body of {SPECK_MASS_KG:g} kg that slides along the line",
        f"joint {name}",
    )
    equality = draft.make_name("equality", item.name)
    site = draft.add_site(item.name, *item.follower)
    add_element(speck, "site", name=draft.make_name("site", f"{item.name}_speck"))
    add_element(
        draft.get_section("equality"),
        "connect",
        name=equality,
        site1=site,
        site2=speck[-1].get("name"),
    )
    return f"equality {equality}"


_MAKERS: Mapping[type, Callable[[MjcfDraft, Any], str]] = {
    b.WeldEquations: partial(_add_site_equality, "weld"),
    b.PointEquations: partial(_add_site_equality, "connect"),
    b.DistanceConstraint: _add_distance,
    b.PointOnLineEquations: _add_point_on_line,
}
"""Functions that add a constraint, by its class."""
