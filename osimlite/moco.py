"""Studies of OpenSim's Moco, solved: ``osimlite.moco.solve("study.omoco")``; docs/optimal-control.md.

Studies from Python are made of the classes that files are (``osimlite.MocoStudy`` and so on), with
OpenSim's names. CasADi is loaded with the first name that is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from osimlite.base.lazy import imported_when_used

if TYPE_CHECKING:
    from osimlite.optimal.inverse import inverse as inverse
    from osimlite.optimal.inverse import problem_of_inverse as problem_of_inverse
    from osimlite.optimal.ipopt import Progress as Progress
    from osimlite.optimal.ipopt import Violation as Violation
    from osimlite.optimal.refinement import Refinement as Refinement
    from osimlite.optimal.solution import MocoSolution as MocoSolution
    from osimlite.optimal.solution import evaluated as evaluated
    from osimlite.optimal.solution import problem_of as problem_of
    from osimlite.optimal.solution import solve as solve
    from osimlite.optimal.track import problem_of_track as problem_of_track
    from osimlite.optimal.track import track as track
    from osimlite.optimal.trajectory import MocoTrajectory as MocoTrajectory

_MODULES = {
    "MocoSolution": "osimlite.optimal.solution",
    "MocoTrajectory": "osimlite.optimal.trajectory",
    "Progress": "osimlite.optimal.ipopt",
    "Refinement": "osimlite.optimal.refinement",
    "Violation": "osimlite.optimal.ipopt",
    "inverse": "osimlite.optimal.inverse",
    "problem_of_inverse": "osimlite.optimal.inverse",
    "evaluated": "osimlite.optimal.solution",
    "problem_of": "osimlite.optimal.solution",
    "problem_of_track": "osimlite.optimal.track",
    "solve": "osimlite.optimal.solution",
    "track": "osimlite.optimal.track",
}

__all__ = [*_MODULES]

__getattr__ = imported_when_used(__name__, _MODULES)
