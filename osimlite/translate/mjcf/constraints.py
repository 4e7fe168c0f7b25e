"""Constraints between bodies."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from osimlite.base.text import add_article
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
            add_constraint = _MAKERS.get(type(constraint))
            if add_constraint is None:
                description = add_article(type(constraint).__name__)
                draft.fidelity.add(
                    "constraint",
                    constraint.name,
                    description,
                    f"{LEFT_OUT}: MuJoCo has no such constraint",
                )
            else:
                draft.fidelity.translated[constraint.name] = add_constraint(draft, constraint)


def _add_site_equality(
    tag: str, draft: MjcfDraft, equations: b.WeldEquations | b.PointEquations
) -> str:
    """Add an equality of a kind ("weld" or "connect") between two sites.

    Returns:
        Kind and name of the element.
    """
    name = draft.make_name("equality", equations.name)
    sites = [draft.add_site(equations.name, *end) for end in (equations.first, equations.second)]
    add_element(draft.get_section("equality"), tag, name=name, site1=sites[0], site2=sites[1])
    return f"equality {name}"


def _add_distance(draft: MjcfDraft, constraint: b.DistanceConstraint) -> str:
    """Add a tendon of constant length; MuJoCo measures from its length with all joints at zero.

    Returns:
        Kind and name of the element.
    """
    name = add_straight_tendon(
        draft,
        constraint.name,
        [draft.add_site(constraint.name, *end) for end in (constraint.first, constraint.second)],
    )
    length = float(
        np.linalg.norm(
            draft.locate_at_zero(constraint.first) - draft.locate_at_zero(constraint.second)
        )
    )
    add_element(
        draft.get_section("equality"),
        "tendon",
        name=name,
        # MuJoCo's tendon equalities are about changes from the length at qpos0.
        tendon1=name,
        # The equality sets the change of length from the reference length.
        polycoef=[constraint.distance - length, 0, 0, 0, 0],
    )
    return f"equality {name}"


def _add_point_on_line(draft: MjcfDraft, equations: b.PointOnLineEquations) -> str:
    """Add a light body that slides along the line, and connect it to the follower.

    MuJoCo has no constraint of a point to a line.

    Returns:
        Kind and name of the element.
    """
    name = draft.make_name("joint", equations.name)
    frame = np.eye(4)
    # The frame has the axes of the body, in which the line is given.
    frame[:3, 3] = equations.line.location
    slider = draft.add_speck(name, draft.bodies[equations.line.body], frame)
    add_element(slider, "joint", name=name, type="slide", axis=equations.along)
    state = draft.mechanism.at(draft.default_state[0])
    line_to_follower = state.point(*equations.follower) - state.point(*equations.line)
    # The slide starts at the projection of the follower on the line.
    draft.starts[name] = float(
        line_to_follower @ state.transform(equations.line.body)[:3, :3] @ equations.along
    )
    draft.fidelity.add(
        "constraint",
        equations.name,
        "a point that stays on a line",
        f"connected to a body of {SPECK_MASS_KG:g} kg that slides along the line",
        f"joint {name}",
    )
    equality = draft.make_name("equality", equations.name)
    site = draft.add_site(equations.name, *equations.follower)
    add_element(slider, "site", name=draft.make_name("site", f"{equations.name}_speck"))
    add_element(
        draft.get_section("equality"),
        "connect",
        name=equality,
        site1=site,
        site2=slider[-1].get("name"),
    )
    return f"equality {equality}"


_MAKERS: Mapping[type, Callable[[MjcfDraft, Any], str]] = {
    b.WeldEquations: partial(_add_site_equality, "weld"),
    b.PointEquations: partial(_add_site_equality, "connect"),
    b.DistanceConstraint: _add_distance,
    b.PointOnLineEquations: _add_point_on_line,
}
"""Functions that add a constraint, by its class."""
