"""Contact forces that follow measured ones: what two goals share."""

from __future__ import annotations

from typing import Any

import numpy as np

from osimlite.base.text import did_you_mean
from osimlite.io.document.kept import read_anew
from osimlite.mechanics.multibody.spatial import Array
from osimlite.optimal.asked import StudyContext
from osimlite.optimal.point import TimeFunction
from osimlite.optimal.problem import Problem
from osimlite.optimal.steps import find_contact
from osimlite.optimal.tables import fit_splines
from osimlite.schema.moco.tracking import MocoContactImpulseTrackingGoal, MocoContactTrackingGoal
from osimlite.schema.prescribed import ExternalLoads
from osimlite.simulation.elements.external_loads import loads_table

Goal = MocoContactTrackingGoal | MocoContactImpulseTrackingGoal


def read_contact_groups(
    goal: Goal, problem: Problem
) -> list[tuple[list[str], list[TimeFunction], Array]]:
    """For each group the paths of its contacts, the measured force along x, y and z of ground (N),
    and the greatest size (3,) that this has along each.

    Raises:
        DocumentError: there are no loads, or no such force or contact.
        UnsupportedError: what is measured is along other axes, or the half space is what it pushes.
    """
    loads: Any = goal.external_loads
    folder, file = problem.folder, problem.file
    if loads is None:
        if not goal.external_loads_file.strip():
            raise problem.invalid_error(
                goal, "it has no external_loads and names no external_loads_file"
            )
        file = problem.locate_file(goal.external_loads_file)
        loads, folder = read_anew(file, ExternalLoads), file.parent
        StudyContext(file, None).check_values(loads)
    table = loads_table(loads, folder, None if file is None else str(file))
    known = {force.name: force for force in loads.objects}
    groups = []
    for group in goal.contact_groups:
        force = known.get(group.external_force_name)
        if force is None:
            near = did_you_mean(group.external_force_name, known)
            raise problem.invalid_error(
                goal, f"the loads have no force '{group.external_force_name}'{near}"
            )
        if force.force_expressed_in_body not in ("ground", "/ground"):
            raise problem.unsupported_error(
                goal, f"the force '{force.name}' is along axes of {force.force_expressed_in_body}"
            )
        labels = [f"{force.force_identifier}{axis}" for axis in "xyz"]
        if not group.contact_force_paths:
            raise problem.invalid_error(group, "it names no contact_force_paths")
        paths = [
            _find_contact_path(goal, problem, str(path), force, group)
            for path in group.contact_force_paths
        ]
        series = fit_splines(problem, table, labels)
        groups.append((paths, series, np.array([np.abs(table[name]).max() for name in labels])))
    return groups


def compute_model_weight(problem: Problem) -> float:
    """That of the model, N; its mass where there is no gravity, as in OpenSim."""
    mechanism = problem.functions.mechanism
    return mechanism.total_mass * (float(np.linalg.norm(mechanism.gravity)) or 1.0)


def _find_contact_path(goal: Goal, problem: Problem, name: str, force: Any, group: Any) -> str:
    """The contact's path; its sphere has to be on the body that the measured force pushes."""
    path, sphere = find_contact(goal, problem, name)
    frames = str(sphere.socket_frame).split("/")
    wanted = [
        force.applied_to_body,
        *(str(frame).rpartition("/")[2] for frame in group.alternative_frame_paths),
    ]
    if not any(each.rpartition("/")[2] in frames for each in wanted):
        message = f"the sphere of '{path}' is on {'/'.join(frames)}, and '{force.name}' pushes {force.applied_to_body}"
        raise problem.unsupported_error(
            goal, f"{message}; contacts whose half space is pushed are not followed here"
        )
    return path
