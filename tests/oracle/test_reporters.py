"""Compare analyses that report quantities of a model with a live OpenSim: files, headers, labels, digits."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import read_sto
from osimlite.schema.model import Model
from osimlite.schema.probe_types import (
    ActuatorForceProbe,
    ActuatorPowerProbe,
    JointInternalPowerProbe,
)

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

from tests.oracle.force_carrier import JOINTS, carrier  # noqa: E402
from tests.oracle.support import OPERATIONS, add_actuators, both, compare  # noqa: E402  # noqa: E402
from tests.scripts import run_script  # noqa: E402

REPORTERS = """<StatesReporter name="S"/><Actuation name="A"/><ProbeReporter name="P"/>
    <ProbeReporter name="Some"><step_interval>3</step_interval></ProbeReporter>"""
# Setup of an analysis along a prescribed motion.
KNOWN = """<output_precision>16</output_precision><initial_time>0.1</initial_time><final_time>0.2</final_time>
    <AnalysisSet><objects>{objects}</objects></AnalysisSet>"""
# Setup of a forward simulation with analyses.
FORWARD = """<OpenSimDocument Version="40600">
    <ForwardTool name="it">
        <model_file>model.osim</model_file>
        <results_directory>{results}</results_directory>
        <output_precision>16</output_precision>
        <final_time>0.1</final_time>
        <AnalysisSet><objects>{objects}</objects></AnalysisSet>
    </ForwardTool>
</OpenSimDocument>
"""


def add_probes(model: Model) -> None:
    """Add probes of actuators with all operations, a disabled one, and a probe of joint power."""
    for operation in OPERATIONS:
        more: dict[str, Any] = {"actuator_names": ("all",), "probe_operation": operation}
        model.add(
            ActuatorForceProbe(name=f"force_{operation}", gain=2.0, **more),
            ActuatorPowerProbe(name=f"power_{operation}", sum_powers_together=True, **more),
        )
    model.add(ActuatorPowerProbe(name="off", actuator_names=("all",), enabled=False))
    model.add(JointInternalPowerProbe(name="joints", joint_names=("all",)))


@pytest.mark.parametrize("joints", JOINTS)
def test_all_actuators_and_operations(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, joints: str
) -> None:
    """Along a prescribed motion, OpenSim's extremes compare only the present value with 0, and rates are 0."""
    monkeypatch.chdir(tmp_path)
    model = carrier(JOINTS[joints])
    add_actuators(model)
    add_probes(model)
    compare(*both(tmp_path, model, "AnalyzeTool", KNOWN.format(objects=REPORTERS)), 1e-9)


def test_real_models(corpus: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    model = osimlite.read(next(item.path for item in corpus if item.id == "m0001"))
    compare(*both(tmp_path, model, "AnalyzeTool", KNOWN.format(objects=REPORTERS)), 1e-9)


def test_along_a_forward_run(corpus: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Probes remember all steps of the integrator, also those without a row in the table.

    The step size follows from an error estimate that is a difference of nearly equal numbers: on
    another processor, rounding of 1e-16 in a state changes a time by 1e-8 s.
    """
    monkeypatch.chdir(tmp_path)
    model = osimlite.read(next(item.path for item in corpus if item.id == "m0001"))
    add_probes(model)
    # Simbody computes the first rate from uninitialised memory.
    for probe in model.probe_set.objects:
        if probe.probe_operation == "differentiate":
            probe.enabled = False
    osimlite.write(model, tmp_path / "model.osim")
    for results in ("ours", "theirs"):
        (tmp_path / f"{results}.xml").write_text(FORWARD.format(results=results, objects=REPORTERS))
    script = "import opensim; opensim.Logger.setLevelString('Error'); assert opensim.ForwardTool('theirs.xml').run()"
    run_script(script)
    osimlite.run("ours.xml")
    names = sorted(path.name for path in (tmp_path / "theirs").iterdir())
    assert sorted(path.name for path in (tmp_path / "ours").iterdir()) == names
    for name in names:
        heads = [
            (tmp_path / folder / name).read_text().partition("endheader\n")[0]
            for folder in ("ours", "theirs")
        ]
        assert heads[0].partition("\nrange")[0] == heads[1].partition("\nrange")[0]
        mine, known = read_sto(tmp_path / "ours" / name), read_sto(tmp_path / "theirs" / name)
        assert mine.columns == known.columns and mine.times == pytest.approx(known.times, abs=1e-7)
        largest = np.abs(known.rows).max(axis=0)
        assert (np.abs(mine.rows - known.rows).max(axis=0) <= 1e-6 * largest + 1e-7).all(), name
