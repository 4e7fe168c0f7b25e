"""Compare joint reactions with OpenSim's.

The tests cover both sides of a joint, frames, welded and coupled joints, and actuators whose forces
are read from a file.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import read_sto, write_sto
from osimlite.models.jumper import jumper
from osimlite.schema.constraint_types import RollingOnSurfaceConstraint
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.forces import ScalarActuator
from osimlite.schema.model import Model
from tests.oracle.support import both, compare, real

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

MORE = """
    <output_precision>16</output_precision><initial_time>0.1</initial_time><final_time>0.14</final_time>
    <solve_for_equilibrium_for_auxiliary_states>true</solve_for_equilibrium_for_auxiliary_states>
    <AnalysisSet><objects>
        <JointReaction name="all"/>
        <JointReaction name="parent">
            <apply_on_bodies>parent</apply_on_bodies><express_in_frame>parent</express_in_frame>
        </JointReaction>
        <JointReaction name="some">
            <joint_names>{joints}</joint_names><apply_on_bodies>child parent</apply_on_bodies>
            <express_in_frame>child {frame}</express_in_frame>
        </JointReaction>
        <JointReaction name="given"><forces_file>forces.sto</forces_file></JointReaction>
    </objects></AnalysisSet>
"""


@pytest.mark.parametrize("name", ["arm26", "jumper", "gait10", "Rajagopal2016", "gait2392"])
def test_joint_reactions(
    corpus: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    ids = {"arm26": "m0001", "gait10": "m0005", "Rajagopal2016": "m0954", "gait2392": "m0013"}
    model: Model = jumper() if name == "jumper" else osimlite.read(real(corpus, ids[name]))
    joints = [joint.name for joint in model.joint_set.objects]
    frame = model.joint_set.objects[0].frames[-1].path if name != "jumper" else "ground"
    actuators = [item.name for item in model.components(ScalarActuator)]
    rows = [[50.0 + 10.0 * k + 100.0 * t for k in range(len(actuators))] for t in (0.0, 0.12, 0.3)]
    write_sto(tmp_path / "forces.sto", "forces", [0.0, 0.12, 0.3], actuators, rows)
    more = MORE.format(joints=f"{joints[0]} {joints[-1]}", frame=frame)
    ours, theirs = both(tmp_path, model, "AnalyzeTool", more)
    largest = max(np.abs(read_sto(file).rows).max() for file in theirs.iterdir())
    # OpenSim's poses fulfil constraints only within 1e-9 rad.
    compare(ours, theirs, 1e-8, (1e-9 if name == "Rajagopal2016" else 1e-10) * largest)


CONSTRAINED = """
    <output_precision>16</output_precision><initial_time>0.1</initial_time><final_time>0.14</final_time>
    <AnalysisSet><objects>
        <ForceReporter name="F"><include_constraint_forces>true</include_constraint_forces></ForceReporter>
        <JointReaction name="child"/>
        <JointReaction name="parent">
            <joint_names>{joints}</joint_names>
            <apply_on_bodies>parent</apply_on_bodies><express_in_frame>parent</express_in_frame>
        </JointReaction>
    </objects></AnalysisSet>
"""


@pytest.mark.parametrize("name", ["couplers", "points on lines", "a point of the shoulder"])
def test_forces_of_constraints(
    corpus: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    ids = {"couplers": "m0954", "points on lines": "m0466", "a point of the shoulder": "m0163"}
    model = osimlite.read(real(corpus, ids[name]))
    # Each program assembles its own pose. A fine accuracy makes them nearly equal.
    model.assembly_accuracy = 1e-12
    for coordinate in model.components(Coordinate):
        coordinate.locked = False
    # OpenSim's moment on the thorax is not about the point that OpenSim writes.
    joints = [
        joint.name
        for joint in model.joint_set.objects
        if type(joint).__name__ != "ScapulothoracicJoint"
    ]
    ours, theirs = both(tmp_path, model, "AnalyzeTool", CONSTRAINED.format(joints=" ".join(joints)))
    assert any(
        "_mobility_F0" in label or "_Fx" in label
        for label in read_sto(theirs / "it_F_forces.sto").columns
    )
    largest = max(np.abs(read_sto(file).rows).max() for file in theirs.iterdir())
    compare(ours, theirs, 1e-8, 1e-10 * largest)


def test_what_rolls_on_a_surface_is_free(
    corpus: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """OpenSim's tools never enforce a RollingOnSurfaceConstraint, whatever `isEnforced` says."""
    monkeypatch.chdir(tmp_path)
    model = osimlite.read(real(corpus, "m0001"))
    bodies = [model.tree().path_of(body) or "" for body in model.body_set.objects]
    model.add(
        RollingOnSurfaceConstraint(
            name="roll", socket_rolling_body=bodies[-1], socket_surface_body=bodies[0]
        )
    )
    ours, theirs = both(tmp_path, model, "AnalyzeTool", CONSTRAINED.format(joints="ALL"))
    assert not any("roll" in label for label in read_sto(theirs / "it_F_forces.sto").columns)
    compare(ours, theirs, 1e-8, 1e-8)
