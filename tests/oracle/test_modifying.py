"""Compare operators on models with OpenSim's ModelProcessor: the resulting models must be equal."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import osimlite
from osimlite.fitting.modifying.operators import process_model
from osimlite.fitting.modifying.path_fitting import fit_paths
from osimlite.schema.difference import find_differences
from osimlite.schema.millard_muscles import Millard2012EquilibriumMuscle
from osimlite.schema.tools import processors as p
from tests.scripts import run_script
from tests.simulation.elements.muscle_rows import hung, line

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

SCRIPT = """
import opensim
opensim.Logger.setLevelString("Off")
processor = opensim.OpenSimObject.makeObjectFromFile("processor.xml")
processor = opensim.ModelProcessor.safeDownCast(processor)
processor.process().printToXML("theirs.osim")
"""
LEGS = ("mtp_r", "subtalar_l")
# Operators by what they change.
CASES: dict[str, list[Any]] = {
    "muscles": [
        p.ModOpReplaceMusclesWithDeGrooteFregly2016(),
        p.ModOpIgnorePassiveFiberForcesDGF(),
        p.ModOpScaleActiveFiberForceCurveWidthDGF(scale_factor=1.5),
        p.ModOpTendonComplianceDynamicsModeDGF(mode="implicit"),
    ],
    "stiff": [
        p.ModOpIgnoreTendonCompliance(),
        p.ModOpIgnoreActivationDynamics(),
        p.ModOpScaleMaxIsometricForce(scale_factor=2.0),
    ],
    "reserves": [
        p.ModOpAddReserves(optimal_force=50.0, bound=2.0),
        p.ModOpAddReserves(optimal_force=3.0),
    ],
    "residuals": [p.ModOpRemoveMuscles(), p.ModOpAddReserves(skip_residual_coordinates=True)],
    "actuators": [p.ModOpReplaceMusclesWithPathActuators()],
    "welds": [
        p.ModOpReplaceJointsWithWelds(joint_paths=LEGS),
        p.ModOpAddReserves(optimal_force=1.0),
    ],
}


def changed(folder: Path, model: Path, operators: list[Any]) -> list[Any]:
    """Apply operators here and in OpenSim and return the differences of the two models."""
    osimlite.write(osimlite.read(model), folder / "model.osim")
    processor = p.ModelProcessor(name="processor", filepath="model.osim", operators=operators)
    osimlite.write(processor, folder / "processor.xml")
    run_script(SCRIPT, folder=folder)
    osimlite.write(process_model(processor, folder), folder / "ours.osim")
    ours, theirs = (osimlite.read(folder / f"{name}.osim") for name in ("ours", "theirs"))
    return [str(item) for item in find_differences(ours, theirs)]


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("number", ["m0013", "m0001"])
def test_the_model_is_that_of_opensim(corpus: Any, tmp_path: Path, case: str, number: str) -> None:
    if case == "welds" and number == "m0001":
        pytest.skip("an arm has no feet")
    path = next(item.path for item in corpus if item.id == number)
    assert not changed(tmp_path, path, CASES[case])


LOADS = """<?xml version="1.0" encoding="UTF-8" ?>
<OpenSimDocument Version="40600">
	<ExternalLoads name="own">
		<objects>
			<ExternalForce name="push">
				<applied_to_body>r_humerus</applied_to_body>
				<force_expressed_in_body>ground</force_expressed_in_body>
				<point_expressed_in_body>ground</point_expressed_in_body>
				<force_identifier>force_v</force_identifier>
				<point_identifier>force_p</point_identifier>
			</ExternalForce>
		</objects>
		<datafile>push.sto</datafile>
	</ExternalLoads>
</OpenSimDocument>
"""
LABELS = ("time", *(f"force_{kind}{axis}" for kind in "vp" for axis in "xyz"))
TABLE = "push\nversion=1\nnRows=2\nnColumns=7\ninDegrees=no\nendheader\n" + "\n".join(
    "\t".join(row) for row in (LABELS, ("0", *"123456"), ("1", *"123456"))
)


def test_files_of_loads_and_paths_are_put_in_as_there(corpus: Any, tmp_path: Path) -> None:
    """OpenSim reads the paths that osimlite has fitted."""
    path = next(item.path for item in corpus if item.id == "m0001")
    (tmp_path / "loads.xml").write_text(LOADS)
    (tmp_path / "push.sto").write_text(TABLE + "\n")
    model = osimlite.read(path)
    paths = [item.path for item in fit_paths(model, poses=60)]
    osimlite.write(p.FunctionBasedPathSet(name="paths", objects=paths), tmp_path / "paths.xml")
    operators = [
        p.ModOpReplacePathsWithFunctionBasedPaths(paths_file="paths.xml"),
        p.ModOpAddExternalLoads(filepath="loads.xml"),
    ]
    # osimlite writes the absolute path of the data, so that the model finds it from any folder.
    (data,) = changed(tmp_path, path, operators)
    assert "what='datafile'" in data and f"old='{tmp_path / 'push.sto'}', new='push.sto'" in data


@pytest.mark.parametrize("minimum", [0.0, 0.005, 0.01, 0.05])
def test_a_muscle_without_dynamics_keeps_the_minimum_that_it_was_read_with(
    tmp_path: Path, minimum: float
) -> None:
    """OpenSim passes `minimum_activation` to the activation model only while the muscle has activation dynamics."""
    import opensim

    from osimlite.mechanics.multibody import build_mechanism
    from osimlite.simulation.elements import force_elements
    from osimlite.simulation.engines.compiled import CompiledEngine

    opensim.Logger.setLevelString("Off")
    for excitation in (0.0, 0.003, 0.03, 0.5):
        muscle = Millard2012EquilibriumMuscle(
            name="mu",
            geometry_path=line(),
            optimal_fiber_length=0.1,
            tendon_slack_length=0.2,
            min_control=minimum,
            minimum_activation=minimum,
            ignore_tendon_compliance=True,
        )
        model = hung(muscle, [excitation, excitation])
        model.find("/jointset/slide/x").default_value = 0.3
        processor = p.ModelProcessor(
            filepath="model.osim", operators=[p.ModOpIgnoreActivationDynamics()]
        )
        osimlite.write(model, tmp_path / "model.osim")
        osimlite.write(processor, tmp_path / "processor.xml")
        ours = process_model(processor, tmp_path)
        theirs = opensim.ModelProcessor(str(tmp_path / "model.osim"))
        theirs.append(opensim.ModOpIgnoreActivationDynamics())
        processed = theirs.process()
        osimlite.write(ours, tmp_path / "written.osim")
        for one, other in (
            (ours, processed),
            (ours.copy_deep(), processed),
            (
                osimlite.read(tmp_path / "written.osim"),
                opensim.Model(str(tmp_path / "written.osim")),
            ),
        ):
            state = other.initSystem()
            other.realizeDynamics(state)
            expected = other.getMuscles().get(0).getActuation(state)
            mechanism = build_mechanism(one)
            engine = CompiledEngine(mechanism, force_elements(one, mechanism))
            (actual,) = engine.force_records(0.0, [0.3, 0.0])
            assert actual == pytest.approx(expected, rel=1e-9, abs=1e-9)
