"""Compare outputs along a motion with a live OpenSim's OutputReporter.

The tests cover the outputs of every class of components.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import read_sto
from osimlite.models.jumper import jumper
from osimlite.schema.millard_muscles import Millard2012AccelerationMuscle
from osimlite.schema.model import Model
from osimlite.schema.states import list_outputs
from osimlite.tools.job import NotRunnable
from osimlite.tools.outputs import LAW_OUTPUTS
from tests.oracle.support import both, real, with_muscles_of

pytestmark = pytest.mark.oracle

MORE = """<output_precision>16</output_precision><initial_time>0.1</initial_time><final_time>0.2</final_time>
    <solve_for_equilibrium_for_auxiliary_states>true</solve_for_equilibrium_for_auxiliary_states>
    <AnalysisSet><objects>
        <OutputReporter name="O"><step_interval>2</step_interval><output_paths>{}</output_paths></OutputReporter>
    </objects></AnalysisSet>"""
# Outputs of stiffness.
STIFF = ("fiber_stiffness", "fiber_stiffness_along_tendon", "muscle_stiffness", "tendon_stiffness")
NOT_YET = {*STIFF, "passive_force_multiplier"}
"""Outputs of muscles that osimlite rejects."""
WITH_MASS = {
    "fiber_force_along_tendon",
    "tendon_force",
    *(name for name in LAW_OUTPUTS if name.startswith("passive")),
}
"""Further outputs that osimlite rejects for muscles with a mass."""
NEVER = {"PathWrapPoint", "PathWrap", "MovingPathPoint"}
"""Classes that are not tested: OpenSim's analysis stops at the outputs of the first two, and osimlite rejects the last."""


def outputs(model: Model) -> list[str]:
    """Return the outputs of a reported type of the first and the last component of each class."""
    tree = model.tree()
    by_class: dict[str, list[Any]] = {"Model": [model]}
    for component in model.components():
        if not tree.is_internal(component):
            by_class.setdefault(type(component).__name__, []).append(component)
    result = []
    for name, components in by_class.items():
        refused = NOT_YET | (WITH_MASS if name == "Millard2012AccelerationMuscle" else set())
        for component in {id(one): one for one in (components[0], components[-1])}.values():
            path = "" if component is model else tree.path_of(component)
            for output, kind in list_outputs(type(component)).items():  # type: ignore[arg-type]
                plain = kind.type in ("double", "Vec3", "SpatialVec") and not kind.channels
                if (
                    plain
                    and output not in refused
                    and name not in NEVER
                    and not output.startswith("implicit")
                ):
                    result.append(f"{path}|{output}")
    return result


@pytest.mark.parametrize("name", ["m0001", "jumper", "m0013", "m0954", "with masses"])
def test_every_output(
    corpus: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Every output agrees to 1e-8 of the largest number of its column.

    Outputs of other types are reported in a message.
    """
    monkeypatch.chdir(tmp_path)
    model = (
        jumper()
        if name == "jumper"
        else osimlite.read(real(corpus, "m0001" if name == "with masses" else name))
    )
    if name == "with masses":
        more = {"default_activation": 0.3, "fiber_damping": 0.2}
        model = with_muscles_of(model, Millard2012AccelerationMuscle, more)
    asked = " ".join(outputs(model))
    ours, theirs = both(tmp_path, model, "AnalyzeTool", MORE.format(asked))
    assert sorted(path.name for path in ours.iterdir()) == sorted(
        path.name for path in theirs.iterdir()
    )
    for file in ours.iterdir():
        known = (theirs / file.name).read_text()
        head = re.sub("OpenSimVersion=.*\n", "", known).splitlines()[:4]
        assert file.read_text().splitlines()[:4] == head
        mine, wanted = read_sto(file), read_sto(theirs / file.name)
        assert mine.times.tolist() == wanted.times.tolist()
        largest = np.nanmax(np.abs(wanted.rows), axis=0, initial=0.0)
        for index, column in enumerate(wanted.columns):
            apart = np.abs(mine.rows[:, index] - wanted.rows[:, index])
            # OpenSim's equilibrium stops at 1e-8 of a force, which limits the energy of a stiff
            # tendon. Its iteration for the fiber velocity stops at 1e-10, which limits the forces
            # that depend on it.
            near = 1e-6 if column.endswith("potential_energy") else 1e-8
            small = max(near, 1e-6 if "fiber" in column else 0.0)
            assert apart.max() <= near * largest[index] + small, column


def test_what_is_no_number_is_left_out_and_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Outputs that are not numbers are omitted with a message, as in OpenSim.

    An alias becomes the label of its column.
    """
    monkeypatch.chdir(tmp_path)
    asked = "/bodyset/pelvis|rotation bodyset/pelvis|position(here) |com_position"
    body = jumper().body_set.objects[0].name
    ours, theirs = both(
        tmp_path, jumper(), "AnalyzeTool", MORE.format(asked.replace("pelvis", body))
    )
    assert (
        [path.name for path in ours.iterdir()]
        == [path.name for path in theirs.iterdir()]
        == ["it_OutputsVec3.sto"]
    )
    labels = read_sto(theirs / "it_OutputsVec3.sto").columns
    assert read_sto(ours / "it_OutputsVec3.sto").columns == labels and "here_x" in labels
    told = dict(osimlite.run(tmp_path / "ours.xml").messages)["O"]
    assert "rotation" in told and "left out" in told


@pytest.mark.parametrize(
    ("asked", "error", "words"),
    [
        ("/bodyset/{body}|positon", osimlite.OsimliteError, "positon"),
        ("/bodyset/nobody|position", osimlite.OsimliteError, "nobody"),
        ("/forceset/{muscle}|tendon_stiffness", NotRunnable, "tendon_stiffness"),
    ],
)
def test_what_is_not_there_is_told(
    tmp_path: Path, asked: str, error: type[Exception], words: str
) -> None:
    """The error is raised before any file is written."""
    from tests.tools.support import tables

    model = jumper()
    names = {
        "body": model.body_set.objects[0].name,
        "muscle": next(iter(model.components(osimlite.Muscle))).name,
    }
    analysis = f'<OutputReporter name="O"><output_paths>{asked.format(**names)}</output_paths></OutputReporter>'
    with pytest.raises(error, match=words):
        tables(tmp_path, model, analysis)
    assert not list(tmp_path.glob("*Outputs*"))
