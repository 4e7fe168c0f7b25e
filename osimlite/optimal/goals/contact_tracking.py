"""Goals that track measured contact forces, or their impulse."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.text import suggest_name
from osimlite.derivatives.symbols import casadi
from osimlite.io.document.cache import read_copy
from osimlite.mechanics.multibody.spatial import Array
from osimlite.optimal.point import (
    Formula,
    GoalTerms,
    PointSymbols,
    TimeFunction,
    make_integral_terms,
    make_projection,
)
from osimlite.optimal.study_context import StudyContext
from osimlite.optimal.tables import fit_splines
from osimlite.schema.contact_forces import SmoothSphereHalfSpaceForce
from osimlite.schema.contact_types import ContactSphere
from osimlite.schema.moco.goals import MocoGoal
from osimlite.schema.moco.tracking import MocoContactImpulseTrackingGoal, MocoContactTrackingGoal
from osimlite.schema.prescribed import ExternalLoads
from osimlite.simulation.elements.external_loads import read_loads_table

if TYPE_CHECKING:
    from osimlite.optimal.problem import Problem

ContactGoal = MocoContactTrackingGoal | MocoContactImpulseTrackingGoal


class ContactGroup(NamedTuple):
    """Contact forces of the model whose sum tracks one measured force.

    Attributes:
        paths: paths of the contact forces.
        measured: measured force along x, y and z of ground, N.
        largest: largest absolute value of the measured force along x, y and z (3,), N.
    """

    paths: list[str]
    measured: list[TimeFunction]
    largest: Array


def build_contact_tracking_goal(goal: MocoContactTrackingGoal, problem: Problem) -> GoalTerms:
    """Return the integral of the squared force error of each contact group over the model's weight, N s.

    With `normalize_tracking_error` each component counts relative to its largest measured value.

    Args:
        goal: goal of the study.
        problem: problem with the contacts.
    """
    project = make_projection(goal, problem)
    groups = read_contact_groups(goal, problem)

    def integrand(point: PointSymbols) -> Formula:
        forces = point.output("contact_forces")
        total = casadi.SX(0.0)
        for group in groups:
            divisors = group.largest if goal.normalize_tracking_error else np.ones(3)
            errors = []
            for axis, series, divisor in zip("xyz", group.measured, divisors, strict=True):
                force = sum(forces[f"{path}|force_{axis}"] for path in group.paths)
                errors.append((force - point.evaluate(series)) / divisor)
            total += casadi.sumsqr(project(casadi.vertcat(*errors)))
        return total

    result = make_integral_terms(integrand)
    model_weight = problem.model_weight
    return GoalTerms(lambda ends: result.value(ends) / model_weight, integrand)


def build_contact_impulse_tracking_goal(
    goal: MocoContactImpulseTrackingGoal, problem: Problem
) -> GoalTerms:
    """Return the squared error of the impulse along an axis of ground over the model's weight, N s².

    Args:
        goal: goal of the study.
        problem: problem with the contacts.

    Raises:
        DocumentError: there is no such axis, or the goal has several groups.
    """
    axis = goal.impulse_axis
    if axis not in range(3):
        raise problem.invalid_error(goal, f"impulse_axis is {axis}; expected 0, 1 or 2")
    if len(goal.contact_groups) != 1:
        raise problem.invalid_error(
            goal, f"it has {len(goal.contact_groups)} contact_groups; OpenSim accepts exactly one"
        )
    (group,) = read_contact_groups(goal, problem)

    def integrand(point: PointSymbols) -> Formula:
        forces = point.output("contact_forces")
        force = sum(forces[f"{path}|force_{'xyz'[axis]}"] for path in group.paths)
        return force - point.evaluate(group.measured[axis])

    result = make_integral_terms(integrand)
    model_weight = problem.model_weight
    return GoalTerms(lambda ends: result.value(ends) ** 2 / model_weight, integrand)


def read_contact_groups(goal: ContactGoal, problem: Problem) -> list[ContactGroup]:
    """Read the measured forces of a goal and match them with the contact forces of the model.

    Args:
        goal: goal with the loads.
        problem: problem with the contacts.

    Returns:
        Contact groups in the order of the goal.

    Raises:
        DocumentError: the goal names no loads, or a force or a contact that does not exist.
        UnsupportedError: the measured force is along axes of a body, or it acts on the body of the
            half space.
    """
    loads: Any = goal.external_loads
    folder = problem.folder
    file = problem.file
    if loads is None:
        if not goal.external_loads_file.strip():
            raise problem.invalid_error(goal, "external_loads or external_loads_file is required")
        file = problem.locate_file(goal.external_loads_file)
        folder = file.parent
        loads = read_copy(file, ExternalLoads)
        StudyContext(file, None).check_values(loads)
    table = read_loads_table(loads, folder, None if file is None else str(file))
    force_by_name = {force.name: force for force in loads.objects}
    groups = []
    for group in goal.contact_groups:
        force = force_by_name.get(group.external_force_name)
        if force is None:
            suggestion = suggest_name(group.external_force_name, force_by_name)
            raise problem.invalid_error(
                goal, f"the loads have no force '{group.external_force_name}'{suggestion}"
            )
        if force.force_expressed_in_body not in ("ground", "/ground"):
            raise problem.make_unsupported_error(
                goal,
                f"the force '{force.name}' is expressed in {force.force_expressed_in_body}; only ground is supported",
            )
        labels = [f"{force.force_identifier}{axis}" for axis in "xyz"]
        if not group.contact_force_paths:
            raise problem.invalid_error(group, "contact_force_paths is required")
        paths = [
            _find_contact_path(goal, problem, str(path), force, group)
            for path in group.contact_force_paths
        ]
        series = fit_splines(problem, table, labels)
        largest = np.array([np.abs(table[name]).max() for name in labels])
        groups.append(ContactGroup(paths, series, largest))
    return groups


def find_contact(goal: MocoGoal, problem: Problem, name: str) -> tuple[str, ContactSphere]:
    """Find a contact force of the model.

    Args:
        goal: goal that names the contact, for messages.
        problem: problem with the model.
        name: path of the contact force, with or without the leading slash.

    Returns:
        Absolute path of the contact force, and its sphere.

    Raises:
        DocumentError: the model has no such contact.
    """
    path = f"/{name.strip('/')}"
    contact: Any = problem.components.get(path)
    if not isinstance(contact, SmoothSphereHalfSpaceForce):
        contact_paths = [
            key
            for key, component in problem.components.items()
            if isinstance(component, SmoothSphereHalfSpaceForce)
        ]
        raise problem.invalid_error(
            goal,
            f"the model has no SmoothSphereHalfSpaceForce '{path}'{suggest_name(path, contact_paths)}",
        )
    sphere = problem.model.tree().target(contact, "socket_sphere", contact.socket_sphere)
    assert isinstance(sphere, ContactSphere)
    return path, sphere


def _find_contact_path(
    goal: ContactGoal, problem: Problem, name: str, force: Any, group: Any
) -> str:
    """Return the path of a contact, whose sphere must be on the body that the measured force acts on.

    Args:
        goal: goal, for messages.
        problem: problem with the contacts.
        name: path of the contact.
        force: measured force.
        group: contact group, which may name other bodies.

    Raises:
        UnsupportedError: the sphere is on another body.
    """
    path, sphere = find_contact(goal, problem, name)
    frames = str(sphere.socket_frame).split("/")
    targets = [
        force.applied_to_body,
        *(str(frame).rpartition("/")[2] for frame in group.alternative_frame_paths),
    ]
    # OpenSim negates the force for the body of the half space; here only the sphere's side is done.
    if not any(target.rpartition("/")[2] in frames for target in targets):
        message = f"the sphere of '{path}' is on {'/'.join(frames)}, and '{force.name}' acts on {force.applied_to_body}"
        raise problem.make_unsupported_error(
            goal, f"{message}; forces on the body of the half space are not supported"
        )
    return path
