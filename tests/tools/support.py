"""Setups, data and comparisons for the tests of tools."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np

import osimlite
from osimlite.io.tables.storage import StoTable, write_sto
from osimlite.io.tables.writers import write_trc
from osimlite.schema.model import Model
from tests.fitting.support import MARKERS, free_body, positions

# Setups in the folder of the trial; the model is in its parent folder.
ANALYZE = """<OpenSimDocument Version="40600"><AnalyzeTool name="an">
<model_file>../model.osim</model_file><results_directory>analyzed</results_directory>
<initial_time>0.1</initial_time><final_time>0.6</final_time>
<AnalysisSet name="Analyses"><objects><Kinematics name="K"/><BodyKinematics name="B"/>
<JointReaction name="J"><apply_on_bodies>parent</apply_on_bodies></JointReaction></objects></AnalysisSet>
<coordinates_file>motion.mot</coordinates_file>
<lowpass_cutoff_frequency_for_coordinates>6</lowpass_cutoff_frequency_for_coordinates>
</AnalyzeTool></OpenSimDocument>
"""


FORWARD = """<OpenSimDocument Version="40600"><ForwardTool name="fw">
<model_file>../model.osim</model_file><results_directory>moved</results_directory>
<initial_time>0.2</initial_time><final_time>0.3</final_time><states_file>states.sto</states_file>
<integrator_error_tolerance>0.001</integrator_error_tolerance>
</ForwardTool></OpenSimDocument>
"""


SCALE = """<OpenSimDocument Version="40600"><ScaleTool name="sc"><mass>70</mass>
<GenericModelMaker><model_file>../model.osim</model_file></GenericModelMaker>
<ModelScaler><apply>true</apply><scaling_order>measurements</scaling_order>
<MeasurementSet name="m"><objects><Measurement name="len"><apply>true</apply>
<MarkerPairSet name="p"><objects><MarkerPair><markers>one two</markers></MarkerPair></objects></MarkerPairSet>
<BodyScaleSet name="b"><objects><BodyScale name="b"><axes>X Y Z</axes></BodyScale></objects></BodyScaleSet>
</Measurement></objects></MeasurementSet>
<marker_file>trial.trc</marker_file><time_range>0 1</time_range>
<output_model_file>scaled.osim</output_model_file></ModelScaler>
<MarkerPlacer><apply>true</apply><IKTaskSet><objects><IKMarkerTask name="one"/><IKMarkerTask name="two"/></objects>
</IKTaskSet><marker_file>trial.trc</marker_file><time_range>0.1 0.5</time_range>
<output_model_file>placed.osim</output_model_file><output_motion_file>static.mot</output_motion_file></MarkerPlacer>
</ScaleTool></OpenSimDocument>
"""


def laid_out(folder: Path) -> Path:
    """Write a model and a trial with setups of all kinds, and return the folder of the trial."""
    osimlite.write(free_body(), folder / "model.osim")
    trial = folder / "trial"
    make_trial(trial, 1, 40)
    for name, text in (("analyze.xml", ANALYZE), ("forward.xml", FORWARD), ("scale.xml", SCALE)):
        (trial / name).write_text(text)
    osimlite.run(trial / "z_ik.xml")
    for name in ("motion.mot", "ik.mot"):
        (trial / name).write_bytes((trial / "ik.mot").read_bytes())
    osimlite.simulate(osimlite.read(folder / "model.osim"), to=0.4, report_interval=0.1).write(
        trial
    )
    return trial


def state(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def unpacked(source: Path, to: Path, name: str) -> None:
    """Copy a file, and decompress it if it is compressed.

    Args:
        source: path of the file, without `.gz`.
        to: folder of the copy.
        name: name of the copy.
    """
    packed = source.with_name(f"{source.name}.gz")
    (to / name).write_bytes(
        gzip.decompress(packed.read_bytes()) if packed.exists() else source.read_bytes()
    )


def make_trial(folder: Path, seed: int, frames: int = 60) -> None:
    """Write markers of a moving body, and setups that fit the motion and compute its forces.

    Args:
        folder: new folder of the trial.
        seed: phase of the motion.
        frames: number of frames.
    """
    folder.mkdir(parents=True)
    times = np.linspace(0.0, 1.0, frames)
    values = 0.3 * np.sin(3.0 * times[:, None] + np.arange(6.0) + seed)
    write_trc(
        folder / "trial.trc",
        times.tolist(),
        MARKERS,
        positions(values).reshape(frames, -1).tolist(),
    )
    osimlite.write(
        osimlite.InverseKinematicsTool(
            name="ik",
            model_file="../model.osim",
            marker_file="trial.trc",
            output_motion_file="ik.mot",
            time_range=(0.0, 1.0),
        ),
        folder / "z_ik.xml",
    )
    osimlite.write(
        osimlite.InverseDynamicsTool(
            name="id",
            model_file="../model.osim",
            coordinates_file="ik.mot",
            output_gen_force_file="id.sto",
            time_range=(0.0, 1.0),
        ),
        folder / "id.xml",
    )


SETUP = """<OpenSimDocument Version="40600">
    <AnalyzeTool name="it">
        <model_file>model.osim</model_file>
        <coordinates_file>motion.sto</coordinates_file>
        <AnalysisSet><objects>{}</objects></AnalysisSet>
    </AnalyzeTool>
</OpenSimDocument>
"""


def tables(folder: Path, model: Model, analyses: str, *, check: bool = True) -> dict[str, StoTable]:
    """Run analyses of a slow motion of a model.

    Args:
        folder: folder of the files.
        model: the model.
        analyses: XML of the analyses.
        check: refuse what OpenSim 4.6 refuses; without it, classes that OpenSim 4.6 lacks are
            accepted.

    Returns:
        Tables by name.
    """
    osimlite.write(model, folder / "model.osim")
    mechanism = osimlite.mechanism(model)
    times = np.linspace(0.0, 0.2, 11)
    rows = [[info.default_value + 0.1 * np.sin(t) for info in mechanism.coordinates] for t in times]
    write_sto(folder / "motion.sto", "motion", times.tolist(), mechanism.coordinate_names, rows)
    (folder / "it.xml").write_text(SETUP.format(analyses))
    return dict(osimlite.run(folder / "it.xml", check=check).tables)
