"""Tests of reactions of a reversed joint, which OpenSim does not have: its child carries its parent in the tree."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import read_sto, write_sto
from osimlite.schema.model import Model

SETUP = """<OpenSimDocument Version="40600"><AnalyzeTool name="it">
    <model_file>model.osim</model_file><coordinates_file>motion.sto</coordinates_file>
    <initial_time>0</initial_time><final_time>1</final_time><output_precision>16</output_precision>
    <AnalysisSet><objects>
        <JointReaction name="J"><joint_names>r_elbow</joint_names><apply_on_bodies>{}</apply_on_bodies></JointReaction>
    </objects></AnalysisSet>
</AnalyzeTool></OpenSimDocument>"""


def reactions(folder: Path, model: Model, elbow: float, side: str) -> Any:
    """Return the reactions of the elbow on a body, for a motion whose elbow angle is scaled by `elbow`."""
    folder.mkdir()
    osimlite.write(model, folder / "model.osim")
    times = np.linspace(0.0, 1.0, 11)
    values = np.column_stack([0.3 * np.sin(3.0 * times), elbow * (0.5 + np.sin(2.0 * times))])
    write_sto(
        folder / "motion.sto", "motion", times, ["r_shoulder_elev", "r_elbow_flex"], values.tolist()
    )
    (folder / "it.xml").write_text(SETUP.format(side))
    osimlite.run(folder / "it.xml", check=False)
    return read_sto(folder / "it_J_ReactionLoads.sto").rows


def test_a_joint_the_other_way_round_carries_the_same(corpus: Any, tmp_path: Path) -> None:
    model = osimlite.read(next(item.path for item in corpus if item.id == "m0001"))
    model.force_set.objects.clear()
    on_child = reactions(tmp_path / "usual", model, 1.0, "child")
    elbow = next(joint for joint in model.joint_set.objects if joint.name == "r_elbow")
    ends = elbow.socket_parent_frame, elbow.socket_child_frame
    elbow.socket_child_frame, elbow.socket_parent_frame = ends
    on_parent = reactions(tmp_path / "reversed", model, -1.0, "parent")
    assert np.abs(on_child[:, :3]).max() > 1.0
    assert on_parent == pytest.approx(on_child, abs=1e-9)
