"""How the studies begin and end that OpenSim's Moco is asked about."""

from __future__ import annotations

import json

import opensim as osim

osim.Logger.setLevelString("Off")


def begun(values, speeds, controls, pattern=".*"):
    """A study of ``model.osim`` over a second, with ranges of values, speeds and of the controls of a pattern."""
    study = osim.MocoStudy()
    problem = study.updProblem()
    problem.setModelProcessor(osim.ModelProcessor("model.osim"))
    problem.setTimeBounds(0, 1)
    problem.setStateInfoPattern(".*/value", values)
    problem.setStateInfoPattern(".*/speed", speeds)
    problem.setControlInfoPattern(pattern, controls)
    return study, problem


def ended(study):
    """Write ``study.omoco`` and where the search leads, ``theirs.sto``, and print the terms of the objective."""
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
