"""Compare MuscleAnalysis of all muscle classes with a live OpenSim: files, headers, labels and numbers."""

from __future__ import annotations

import gzip
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import read_sto
from osimlite.schema.millard_muscles import (
    Millard2012AccelerationMuscle,
    Millard2012EquilibriumMuscle,
    RigidTendonMuscle,
)
from osimlite.schema.muscles import Muscle, Thelen2003Muscle
from osimlite.schema.old_muscles import Schutte1993Muscle_Deprecated, Thelen2003Muscle_Deprecated
from osimlite.schema.smooth_muscles import DeGrooteFregly2016Muscle, MeyerFregly2016Muscle

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

from tests.oracle.support import both, with_muscles_of  # noqa: E402
from tests.suite import choose  # noqa: E402

END = choose("0.14", "0.2")
MORE = f"""<output_precision>17</output_precision><initial_time>0.1</initial_time><final_time>{END}</final_time>
    <solve_for_equilibrium_for_auxiliary_states>{{equilibrium}}</solve_for_equilibrium_for_auxiliary_states>
    <AnalysisSet><objects><MuscleAnalysis name="M"/>{{others}}</objects></AnalysisSet>"""
OTHERS = """<MuscleAnalysis name="Some"><muscle_list> {muscle} </muscle_list>
    <moment_arm_coordinate_list> {coordinate} </moment_arm_coordinate_list></MuscleAnalysis>
    <MuscleAnalysis name="No"><compute_moments>false</compute_moments></MuscleAnalysis>"""
CLASSES: dict[str, tuple[type[Muscle], dict[str, Any]]] = {
    "millard": (Millard2012EquilibriumMuscle, {}),
    "millard, rigid tendon": (Millard2012EquilibriumMuscle, {"ignore_tendon_compliance": True}),
    "millard, damping that does not count": (
        Millard2012EquilibriumMuscle,
        {"fiber_damping": 0.0005},
    ),
    "millard, with a mass": (
        Millard2012AccelerationMuscle,
        {"default_activation": 0.3, "fiber_damping": 0.2},
    ),
    "thelen": (Thelen2003Muscle, {}),
    "thelen, shortest fibers": (Thelen2003Muscle, {"default_fiber_length": 0.001}),
    "degroote": (DeGrooteFregly2016Muscle, {"fiber_damping": 0.1}),
    "degroote, rigid tendon": (DeGrooteFregly2016Muscle, {"ignore_tendon_compliance": True}),
    "degroote, implicit": (
        DeGrooteFregly2016Muscle,
        {"tendon_compliance_dynamics_mode": "implicit"},
    ),
    "meyer": (MeyerFregly2016Muscle, {"ignore_tendon_compliance": True, "fiber_damping": 0.05}),
    "rigid": (RigidTendonMuscle, {}),
    "first thelen": (Thelen2003Muscle_Deprecated, {}),
    "schutte": (Schutte1993Muscle_Deprecated, {}),
}


def compare(ours: Path, theirs: Path, tolerance: float = 1e-8, small: float = 5e-7) -> None:
    """Compare two output folders: same files, headers, labels and NaN, and nearly equal numbers.

    OpenSim iterates fiber velocities up to an error of 1e-10 of the strength; osimlite's are exact.

    Args:
        ours: output folder of osimlite.
        theirs: output folder of OpenSim.
        tolerance: largest difference relative to the largest number of the column.
        small: absolute difference that is allowed in addition.
    """
    assert sorted(path.name for path in ours.iterdir()) == sorted(
        path.name for path in theirs.iterdir()
    )
    for file in ours.iterdir():
        one, two = (
            path.read_text().partition("endheader\n") for path in (file, theirs / file.name)
        )
        # Only osimlite's headers say where the table contains NaN.
        header = re.sub(r"NaN stands .*\n", "", one[0])
        assert (header, one[2].partition("\n")[0]) == (two[0], two[2].partition("\n")[0]), file.name
        mine, known = read_sto(file).rows, read_sto(theirs / file.name).rows
        assert np.isnan(mine).tolist() == np.isnan(known).tolist(), file.name
        largest = np.abs(np.nan_to_num(known)).max(axis=0)
        assert (
            np.abs(np.nan_to_num(mine - known)).max(axis=0) <= tolerance * largest + small
        ).all(), file.name


@pytest.mark.parametrize("equilibrium", ["false", "true"])
@pytest.mark.parametrize("case", CLASSES)
def test_classes(
    corpus: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case: str, equilibrium: str
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    model = osimlite.read(next(item.path for item in corpus if item.id == "m0001"))
    others = OTHERS.format(muscle="BRA TRIlong", coordinate="r_elbow_flex")
    more = MORE.format(equilibrium=equilibrium, others=others)
    compare(*both(tmp_path, with_muscles_of(model, *CLASSES[case]), "AnalyzeTool", more))


def test_no_dynamics_without_mass(
    corpus: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    model = osimlite.read(next(item.path for item in corpus if item.id == "m0001"))
    for body in model.body_set.objects:
        body.mass = 0.0
    ours, theirs = both(tmp_path, model, "AnalyzeTool", MORE.format(equilibrium="true", others=""))
    compare(ours, theirs)
    assert np.isnan(read_sto(theirs / "it_M_FiberVelocity.sto").rows).all()


@pytest.mark.parametrize("name", ["gait10_subject01", "gait2354_subject01_simbody"])
def test_models_of_walking(
    shared: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    packed = shared / "oracle" / "tools" / "reference" / "models" / f"{name}.osim.gz"
    (tmp_path / "read.osim").write_bytes(gzip.decompress(packed.read_bytes()))
    model = osimlite.read(tmp_path / "read.osim")
    compare(*both(tmp_path, model, "AnalyzeTool", MORE.format(equilibrium="true", others="")))


def test_rajagopal(corpus: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A model with eighty muscles and patellae on couplers.

    OpenSim ends its iteration for equilibrium at 1e-8 of a strength.
    """
    monkeypatch.chdir(tmp_path)
    model = osimlite.read(next(item.path for item in corpus if item.id == "m0954"))
    compare(
        *both(tmp_path, model, "AnalyzeTool", MORE.format(equilibrium="true", others="")),
        small=1e-7,
    )
