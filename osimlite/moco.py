"""Studies of OpenSim's Moco, solved: ``osimlite.moco.solve("study.omoco")``; docs/optimal-control.md.

Studies from Python are made of the classes that files are (``osimlite.MocoStudy`` and so on), with OpenSim's names.
"""

from osimlite.optimal.ipopt import Progress as Progress
from osimlite.optimal.ipopt import Violation as Violation
from osimlite.optimal.solution import MocoSolution as MocoSolution
from osimlite.optimal.solution import evaluated as evaluated
from osimlite.optimal.solution import problem_of as problem_of
from osimlite.optimal.solution import solve as solve
from osimlite.optimal.trajectory import MocoTrajectory as MocoTrajectory

__all__ = ["MocoSolution", "MocoTrajectory", "Progress", "Violation", "evaluated", "problem_of", "solve"]
