"""Solve studies of OpenSim's Moco: ``osimlite.moco.solve("study.omoco")``; docs/optimal-control.md.

Studies in Python are made of the same classes as study files (``osimlite.MocoStudy`` and so on), with OpenSim's names.
CasADi is imported when one of the names below is used for the first time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from osimlite.base.lazy import make_lazy_getattr

if TYPE_CHECKING:
    from osimlite.optimal.inverse import build_inverse_problem as build_inverse_problem
    from osimlite.optimal.inverse import solve_inverse as solve_inverse
    from osimlite.optimal.ipopt import Progress as Progress
    from osimlite.optimal.ipopt import Violation as Violation
    from osimlite.optimal.refinement import Refinement as Refinement
    from osimlite.optimal.solution import Evaluation as Evaluation
    from osimlite.optimal.solution import MocoSolution as MocoSolution
    from osimlite.optimal.solution import build_problem as build_problem
    from osimlite.optimal.solution import evaluate as evaluate
    from osimlite.optimal.solution import solve as solve
    from osimlite.optimal.track import build_track_problem as build_track_problem
    from osimlite.optimal.track import solve_track as solve_track
    from osimlite.optimal.trajectory import MocoTrajectory as MocoTrajectory

_MODULES = {
    "Evaluation": "osimlite.optimal.solution",
    "MocoSolution": "osimlite.optimal.solution",
    "MocoTrajectory": "osimlite.optimal.trajectory",
    "Progress": "osimlite.optimal.ipopt",
    "Refinement": "osimlite.optimal.refinement",
    "Violation": "osimlite.optimal.ipopt",
    "build_inverse_problem": "osimlite.optimal.inverse",
    "build_problem": "osimlite.optimal.solution",
    "build_track_problem": "osimlite.optimal.track",
    "evaluate": "osimlite.optimal.solution",
    "solve": "osimlite.optimal.solution",
    "solve_inverse": "osimlite.optimal.inverse",
    "solve_track": "osimlite.optimal.track",
}
"""Module that defines each public name."""

_DEPRECATED = {
    "evaluated": "evaluate",
    "inverse": "solve_inverse",
    "problem_of": "build_problem",
    "problem_of_inverse": "build_inverse_problem",
    "problem_of_track": "build_track_problem",
    "track": "solve_track",
}
"""Names before release 0.1.0, with the public names that replace them."""

__all__ = [*_MODULES]

__getattr__ = make_lazy_getattr(__name__, _MODULES, _DEPRECATED)
