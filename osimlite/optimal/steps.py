"""Steps of a walk, as goals of asymmetry tell them, and the contacts of feet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from osimlite.base.text import did_you_mean
from osimlite.derivatives.symbols import casadi
from osimlite.optimal.point import Formula
from osimlite.optimal.problem import Problem
from osimlite.schema.contact import ContactSphere
from osimlite.schema.contact_forces import SmoothSphereHalfSpaceForce
from osimlite.schema.moco.goals import MocoGoal


def get_component(direction: str, vector: Sequence[Formula] | Formula) -> Formula:
    """The part of a vector in ground along a direction such as ``negative-x``."""
    sign, _, axis = direction.partition("-")
    return vector["xyz".index(axis)] * (1.0 if sign == "positive" else -1.0)


def smooth_step(value: Formula, middle: float, half: float, sharpness: float) -> Formula:
    """A step at zero between two numbers, as smooth as a hyperbolic tangent."""
    return middle + half * casadi.tanh(sharpness * value)


def find_contact(goal: MocoGoal, problem: Problem, name: str) -> tuple[str, ContactSphere]:
    """The path of a contact force, and its sphere.

    Raises:
        DocumentError: the model has no such contact.
    """
    path = f"/{name.strip('/')}"
    contact: Any = problem.components.get(path)
    if not isinstance(contact, SmoothSphereHalfSpaceForce):
        known = [
            key
            for key, part in problem.components.items()
            if isinstance(part, SmoothSphereHalfSpaceForce)
        ]
        raise problem.invalid_error(
            goal, f"the model has no SmoothSphereHalfSpaceForce '{path}'{did_you_mean(path, known)}"
        )
    sphere = problem.model.tree().target(contact, "socket_sphere", contact.socket_sphere)
    assert isinstance(sphere, ContactSphere)
    return path, sphere
