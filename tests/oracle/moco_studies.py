"""Functions that set up and solve the studies of the scripts for OpenSim's Moco."""

from __future__ import annotations

import json

import opensim as osim

osim.Logger.setLevelString("Off")


def begun(values, speeds, controls, pattern=".*"):
    """Return a study of ``model.osim`` over one second, and its problem.

    Args:
        values: bounds of all coordinate values.
        speeds: bounds of all speeds.
        controls: bounds of the controls that match `pattern`.
        pattern: regular expression of controls.
    """
    study = osim.MocoStudy()
    problem = study.updProblem()
    problem.setModelProcessor(osim.ModelProcessor("model.osim"))
    problem.setTimeBounds(0, 1)
    problem.setStateInfoPattern(".*/value", values)
    problem.setStateInfoPattern(".*/speed", speeds)
    problem.setControlInfoPattern(pattern, controls)
    return study, problem


def ended(study):
    """Write ``study.omoco``, solve the study, write ``theirs.sto`` and print the objective terms as JSON.

    The solution is written even if Moco reports a failure, since some studies stop after one
    iteration.
    """
    study.printToXML("study.omoco")
    solution = study.solve()
    if solution.isSealed():
        solution.unseal()
    solution.write("theirs.sto")
    names = solution.getObjectiveTermNames()
    print(
        json.dumps(
            {name: solution.getObjectiveTermByIndex(place) for place, name in enumerate(names)}
        )
    )
