"""Contact forces follow measured ones."""

from __future__ import annotations

from typing import Any

import numpy as np

from osimlite.backends.symbols import casadi
from osimlite.document.kept import read_anew
from osimlite.optimal.point import Formula, Point, Terms, integral
from osimlite.optimal.problem import Problem
from osimlite.optimal.projection import projected
from osimlite.optimal.steps import contact_at
from osimlite.optimal.tables import splines
from osimlite.schema.moco.tracking import MocoContactTrackingGoal
from osimlite.schema.prescribed import ExternalLoads
from osimlite.simulation.elements.external_loads import loads_table
from osimlite.text import did_you_mean


def terms(goal: MocoContactTrackingGoal, problem: Problem) -> Terms:
    """The integral of the squares of the missing force of each group, over the weight of the model."""
    loads: Any = goal.external_loads
    folder = problem.folder
    if loads is None:
        if not goal.external_loads_file.strip():
            raise problem.wrong(goal, "it has no external_loads and names no external_loads_file")
        path = problem.place(goal.external_loads_file)
        loads, folder = read_anew(path, ExternalLoads), path.parent
    table = loads_table(loads, folder, None)
    known = {force.name: force for force in loads.objects}
    along = projected(goal, problem)
    groups = []
    for group in goal.contact_groups:
        force = known.get(group.external_force_name)
        if force is None:
            near = did_you_mean(group.external_force_name, known)
            raise problem.wrong(goal, f"the loads have no force '{group.external_force_name}'{near}")
        if force.force_expressed_in_body not in ("ground", "/ground"):
            raise problem.refused(goal, f"the force '{force.name}' is along axes of {force.force_expressed_in_body}")
        labels = [f"{force.force_identifier}{axis}" for axis in "xyz"]
        scale = [float(np.abs(table[name]).max()) for name in labels] if goal.normalize_tracking_error else [1.0] * 3
        paths = [_path(goal, problem, str(path), force, group) for path in group.contact_force_paths]
        groups.append((paths, splines(problem, table, labels), scale))
    mechanism = problem.functions.mechanism
    pull = float(np.linalg.norm(mechanism.gravity))
    weight = mechanism.total_mass * (pull if pull > 0.0 else 1.0)

    def integrand(point: Point) -> Formula:
        pushes, total = point.output("contact_forces"), casadi.SX(0.0)
        for paths, measured, scale in groups:
            parts = []
            for axis, series, by in zip("xyz", measured, scale, strict=True):
                push = sum(pushes[f"{path}|force_{axis}"] for path in paths)
                parts.append((push - point.at(series)) / by)
            total += casadi.sumsqr(along(casadi.vertcat(*parts)))
        return total

    result = integral(integrand)
    return Terms(lambda ends: result.value(ends) / weight, integrand)


def _path(goal: MocoContactTrackingGoal, problem: Problem, name: str, force: Any, group: Any) -> str:
    """The contact's path; its sphere has to be on the body that the measured force pushes."""
    path, sphere = contact_at(goal, problem, name)
    frames = str(sphere.socket_frame).split("/")
    wanted = [force.applied_to_body, *(str(frame).rpartition("/")[2] for frame in group.alternative_frame_paths)]
    if not any(each.rpartition("/")[2] in frames for each in wanted):
        message = f"the sphere of '{path}' is on {'/'.join(frames)}, and '{force.name}' pushes {force.applied_to_body}"
        raise problem.refused(goal, f"{message}; contacts whose half space is pushed are not followed here")
    return path
