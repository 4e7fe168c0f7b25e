"""Compare the names of states and the motion types of coordinates with OpenSim's."""

from __future__ import annotations

from pathlib import Path

import pytest

from osimlite import read
from osimlite.schema.states import find_variables, list_motions

opensim = pytest.importorskip("opensim")
pytestmark = pytest.mark.oracle

MODELS = {
    "m0072": "a muscle with a rigid tendon",
    "m0109": "Schutte1993Muscle",
    "m0123": "DeGrooteFregly2016Muscle",
    "m0139": "custom joints with functions of several coordinates",
    "m0466": "BushingForce",
    "m0001": "Thelen2003Muscle",
    "m0005": "Millard2012EquilibriumMuscle, a whole body",
}
# Motion types in the order of OpenSim's enumeration.
MOTIONS = ("undefined", "rotational", "translational", "coupled")


@pytest.mark.parametrize("name", MODELS, ids=MODELS.get)
def test_states_and_motions_are_opensims(corpus, name):
    path: Path = next(model.path for model in corpus if model.id == name)
    tree = read(path).tree()
    theirs = opensim.Model(str(path))
    theirs.initSystem()
    names = theirs.getStateVariableNames()
    assert set(find_variables(tree, "state variable")) == {
        names.get(k) for k in range(names.getSize())
    }
    motions = {
        name: motion
        for joint in tree.find_by_class("Joint").values()
        for name, motion in list_motions(joint).items()
    }
    assert motions == {
        item.getName(): MOTIONS[item.getMotionType()] for item in theirs.getCoordinateSet()
    }
