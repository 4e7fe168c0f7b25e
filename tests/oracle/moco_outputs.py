"""Run OpenSim's Moco on a study with goals of model outputs for one iteration.

The script writes the study and the result. It runs in a folder with ``model.osim`` and
``outputs.json``, which holds the class and the properties of each goal.
"""

from __future__ import annotations

import json
from pathlib import Path

import opensim as osim

from tests.oracle.moco_studies import begun, ended

study, problem = begun([-1, 1.2], [-5, 7], [-10, 12], "/tau.*")
for number, (kind, path, index, exponent, operation, second) in enumerate(
    json.loads(Path("outputs.json").read_text())
):
    goal = getattr(osim, kind)(f"g{number}", 1.0)
    goal.setOutputPath(path)
    goal.setOutputIndex(index)
    goal.setExponent(exponent)
    if operation:
        goal.setOperation(operation)
        goal.setSecondOutputPath(second)
    problem.addGoal(goal)
bound = osim.MocoOutputBoundConstraint()
bound.setName("low")
bound.setOutputPath("/markerset/tip|location")
bound.setOutputIndex(1)
bound.setUpperBound(osim.LinearFunction(0.5, -1.2))
problem.addPathConstraint(bound)
solver = study.initCasADiSolver()
solver.set_num_mesh_intervals(4)
solver.set_optim_max_iterations(1)
ended(study)
