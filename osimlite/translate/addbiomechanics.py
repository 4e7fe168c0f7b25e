"""A subject of AddBiomechanics (.b3d) as a folder of files for OpenSim: models, trials and setups."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.files import make_folder, write_atomically
from osimlite.base.text import format_count
from osimlite.errors import OsimliteError, SettingError
from osimlite.io.b3d.messages import MISSING_FORCE_REASONS, PASS_FIELDS, PASS_TYPES
from osimlite.io.b3d.reader import read_b3d
from osimlite.io.b3d.subject import B3dTrial
from osimlite.io.document.printer import to_text
from osimlite.io.tables.storage import StoTable, write_sto
from osimlite.io.tables.writers import write_trc
from osimlite.mechanics.multibody.schema_functions import convert_function
from osimlite.schema.constraint_types import CoordinateCouplerConstraint
from osimlite.schema.prescribed import ExternalForce, ExternalLoads
from osimlite.schema.tools.analyses import BodyKinematics, Kinematics
from osimlite.schema.tools.base import AnalysisSet
from osimlite.schema.tools.dynamics import AnalyzeTool, InverseDynamicsTool
from osimlite.simulation.robot.names import UniqueNames
from osimlite.translate.fidelity import LEFT_OUT, Error, Fidelity
from osimlite.translate.nimble import convert_from_nimble

COORDINATES_FILE = "coordinates.mot"
"""File of the coordinates of a trial."""
MARKERS_FILE = "markers.trc"
"""File of the markers of a trial."""
FORCES_FILE = "ground_forces.mot"
"""File of the ground forces of a trial."""
LOADS_FILE = "external_loads.xml"
"""Document of the external loads of a trial."""
PLATES_FILE = "force_plates.sto"
"""File of the readings of the force plates of a trial."""
MOMENTS_FILE = "addbiomechanics_moments.sto"
"""File of the generalized forces that AddBiomechanics computed for a trial."""
MISSING_FILE = "missing_forces.sto"
"""File of the frames whose forces are not to be trusted."""
INVERSE_DYNAMICS_FILE = "inverse_dynamics.xml"
"""Setup of OpenSim's inverse dynamics for a trial."""
ANALYZE_FILE = "analyze.xml"
"""Setup of OpenSim's analyses for a trial."""
RESULTS_FOLDER = "results"
"""Folder of the results of the setups of a trial."""

SENSOR_TABLES = {
    "accelerometers": ("accelerometer_names", "xyz"),
    "gyroscopes": ("gyroscope_names", "xyz"),
    "emg": ("emg_names", ""),
    "custom": ("custom_names", ""),
    "exo": ("exo_dofs", ""),
}
"""Measurements that become a table each: the names in the header, and the axes of a sensor."""

DERIVED_FIELDS = ("velocities", "accelerations", "mass_center", "joint_centers", "root_residual")
"""Arrays of a pass that follow from coordinates, forces and the model; they are not written."""

KINEMATICS = PASS_TYPES.index("kinematics")
"""Number of the type of passes whose coordinates were fitted frame by frame, without a filter."""

RAW_LOWPASS_HZ = 6.0
"""Cutoff frequency of setups for such coordinates; other passes are filtered already."""

LOADED_FORCE_N = 50.0
"""Vertical force above which centres of pressure are compared, as below it they are ill-conditioned."""


class SubjectFolder:
    """Conversion of a subject.

    Args:
        path: path of the .b3d file.
        name: name of the subject; that of the file by default.
        processing_pass: type of the pass to write the trials of; None for dynamics, or else the
            last one.

    Raises:
        OsimliteError: the file cannot be read, or no trial has such a pass.
    """

    def __init__(
        self, path: str | Path, name: str | None = None, processing_pass: str | None = None
    ) -> None:
        self.subject = read_b3d(path)
        self.name = name or Path(path).stem
        self._pass = processing_pass
        if processing_pass is not None and processing_pass not in self.subject.pass_types:
            raise SettingError(
                f"the file has no processing pass '{processing_pass}'; it has: {', '.join(self.subject.pass_types)}"
            )
        self.fidelity = Fidelity(self.name, "project")
        self.summary: dict[str, object] = {}
        self._models: dict[int, str] = {}

    def write(self, folder: str | Path) -> list[Path]:
        """Write models, trials and setups into a folder, which is made if it does not exist.

        Returns:
            The written files, models first.

        Raises:
            DocumentError: the file is damaged.
            OsimliteError: a file cannot be written.
        """
        base = Path(folder)
        header = self.subject.header
        written = self._write_models(base)
        # Several trials may have the same name.
        names = UniqueNames()
        trials = []
        for trial in self.subject.trials:
            trial_files, facts = self._write_trial(trial, base, names(trial.name or "trial"))
            written += trial_files
            trials.append(facts)
        self.summary = {
            "subject": {
                "mass_kg": self.subject.mass,
                "height_m": self.subject.height,
                "age_years": self.subject.age,
                "sex": header["sex"],
                "tags": list(header["tags"]),
                "quality": self.subject.quality,
                "href": header["href"],
                "notes": header["notes"],
            },
            "contact_bodies": list(self.subject.contact_bodies),
            "models": [
                {"type": pass_type, "file": self._models[index]}
                for index, pass_type in enumerate(self.subject.pass_types)
                if index in self._models
            ],
            "trials": trials,
        }
        return written

    def _write_models(self, base: Path) -> list[Path]:
        """Write the models of the passes; also a version for OpenSim if Nimble reads one differently.

        Returns:
            Paths of the written files.
        """
        files = []
        names = UniqueNames()
        make_folder(base / "models")
        for index, (pass_type, text) in enumerate(
            zip(self.subject.pass_types, self.subject.model_texts, strict=True)
        ):
            name = names(pass_type)
            # Files without models hold raw data.
            if not text:
                self.fidelity.add(
                    "model",
                    f"/passes/{name}",
                    "a processing pass without a model in the file",
                    LEFT_OUT,
                )
                continue
            path = base / "models" / f"{name}.osim"
            write_atomically(path, text)
            files.append(path)
            self._models[index] = f"models/{name}.osim"
            self.fidelity.translated[f"/passes/{name}/model"] = self._models[index]
            # The conversion changes the model in place.
            model = self.subject.read_model(index)
            try:
                # Changes that do nothing in OpenSim are for information only.
                changes = [change for change in convert_from_nimble(model) if change.done]
            except OsimliteError as error:
                self.fidelity.add(
                    "joint",
                    f"/passes/{name}/model",
                    "what Nimble computes differently with this model",
                    "the model is used unchanged",
                    error.message,
                )
                continue
            # Constraints are turned off in any case; only other changes need a second file.
            motion_changes = [change for change in changes if "isEnforced" not in change.done]
            for change in motion_changes:
                self.fidelity.add(
                    "joint",
                    f"/passes/{name}/model{change.component}",
                    change.difference,
                    f"models/{name}_opensim.osim: {change.done}",
                )
            # The setups of the trials use the model that moves as Nimble computed it.
            if motion_changes:
                converted_path = base / "models" / f"{name}_opensim.osim"
                write_atomically(converted_path, to_text(model))
                files.append(converted_path)
                self._models[index] = f"models/{name}_opensim.osim"
        return files

    def _write_trial(
        self, trial: B3dTrial, base: Path, name: str
    ) -> tuple[list[Path], dict[str, object]]:
        """Write the files of a trial.

        Returns:
            Paths of the written files, and facts about the trial for the summary.
        """
        folder = make_folder(base / "trials" / name)
        trial_path = f"/trials/{name}"
        times = trial.times
        arrays = trial.read_arrays()
        paths: list[Path] = []

        def write_table(
            file: str, table: StoTable, source: str, *, has_missing: bool = True
        ) -> None:
            path = folder / file
            write_sto(path, name, table.times, table.columns, table.rows, has_missing=has_missing)
            paths.append(path)
            self.fidelity.translated[f"{trial_path}/{source}"] = f"trials/{name}/{file}"

        facts: dict[str, object] = {"name": trial.name, "folder": f"trials/{name}"}
        facts |= _describe_trial(trial)
        markers, positions = trial.read_markers()
        if markers:
            # Older programs wrote zeros for markers that were not seen.
            unseen = np.asarray(~positions.any(axis=2))
            positions = np.where(unseen[:, :, None], np.nan, positions)
            if unseen.any():
                self.fidelity.add(
                    "marker",
                    f"{trial_path}/markers",
                    "a marker at the origin of ground, which means that it was not seen",
                    "written as a gap",
                    format_count(int(unseen.sum()), "position"),
                )
            rows = positions.reshape(len(times), -1)
            write_trc(folder / MARKERS_FILE, times.tolist(), markers, rows)
            paths.append(folder / MARKERS_FILE)
            self.fidelity.translated[f"{trial_path}/markers"] = f"trials/{name}/{MARKERS_FILE}"
        unnamed = len(self.subject.marker_names) - len(markers)
        if unnamed:
            self.fidelity.add(
                "marker",
                f"{trial_path}/markers",
                "a marker without a name",
                LEFT_OUT,
                f"{format_count(unnamed, 'marker')}",
            )
        plates = trial.read_force_plates()
        if plates.columns:
            write_table(PLATES_FILE, plates, "plates")
        for source, (key, axes) in SENSOR_TABLES.items():
            if source in arrays:
                labels = _label_columns(self.subject.header, key, axes, arrays[source].shape[1])
                write_table(f"{source}.sto", StoTable(name, times, labels, arrays[source]), source)
        reason_codes = trial.missing_forces
        if reason_codes.any():
            write_table(
                MISSING_FILE,
                StoTable(name, times, ("reason",), reason_codes[:, None].astype(float)),
                "missing_forces",
            )
        index = self._find_pass(trial)
        # Trials without this pass still have markers and plates.
        if index is None:
            self.fidelity.add(
                "pass",
                trial_path,
                "coordinates and forces of a trial without such a processing pass",
                LEFT_OUT,
            )
            return paths, facts
        facts["pass"] = trial.passes[index].name
        write_table(
            COORDINATES_FILE,
            self._complete_coordinates(trial, index),
            "coordinates",
            has_missing=False,
        )
        # Ground forces come from the selected pass, as the model does.
        forces = trial.read_ground_forces(index)
        if forces.columns:
            write_table(FORCES_FILE, forces, "ground_forces", has_missing=False)
            self._note_forces(trial, index, forces, trial_path)
            paths.append(
                _write_document(folder / LOADS_FILE, _create_loads(self.subject.contact_bodies))
            )
        moments = trial.read_moments(index)
        if moments.rows.any():
            write_table(MOMENTS_FILE, moments, "moments")
        self._note_left_out(trial, index, trial_path)
        if index in self._models and len(times) > 1:
            model = f"../../{self._models[index]}"
            loads = LOADS_FILE if forces.columns else ""
            is_raw = trial.passes[index].type == KINEMATICS
            # A negative frequency turns the filter off in OpenSim.
            cutoff = RAW_LOWPASS_HZ if is_raw else -1.0
            facts["setup_lowpass_hz"] = cutoff if is_raw else None
            setups = _create_setups(name, model, loads, (float(times[0]), float(times[-1])), cutoff)
            paths += [_write_document(folder / file, setup) for file, setup in setups.items()]
        return paths, facts

    def _find_pass(self, trial: B3dTrial) -> int | None:
        """Return the index of the pass to write; None if the trial does not have it."""
        try:
            return trial.find_pass(self._pass)
        except SettingError:
            return None

    def _complete_coordinates(self, trial: B3dTrial, index: int) -> StoTable:
        """Return the coordinates, with those that constraints determine and Nimble does not have.

        Nimble leaves out the patellae, whose coordinates follow the knees.
        """
        table = trial.read_coordinates(index)
        columns = list(table.columns)
        rows = [*table.rows.T]
        for coupler in self.subject.read_model(index).components(CoordinateCouplerConstraint):
            name = _get_last_name(str(coupler.dependent_coordinate_name))
            arguments = [
                _get_last_name(str(coordinate))
                for coordinate in coupler.independent_coordinate_names
            ]
            function = coupler.coupled_coordinates_function
            # A coordinate that the file has is not computed again.
            if name in columns or function is None or not {*arguments} <= {*table.columns}:
                continue
            curve = convert_function(function, len(arguments), coupler.path)
            values = np.array([table[argument] for argument in arguments]).T
            results = [coupler.scale_factor * float(curve.evaluate(row)[0]) for row in values]
            columns.append(name)
            rows.append(np.array(results))
        return StoTable(
            table.name, table.times, tuple(columns), np.array(rows).T.reshape(len(table.times), -1)
        )

    def _note_forces(self, trial: B3dTrial, index: int, forces: StoTable, trial_path: str) -> None:
        """Note how the written forces differ from the file's centres of pressure, and which are missing."""
        reason_codes = trial.missing_forces
        if reason_codes.any():
            counts = Counter(reason_codes[reason_codes != 0].tolist())
            summary = ", ".join(
                f"{count} of '{_describe_reason(number)}'" for number, count in counts.items()
            )
            self.fidelity.add(
                "missing-forces",
                f"{trial_path}/ground_forces",
                "missing or wrong forces of a frame",
                f"the forces are written, and {MISSING_FILE} has the reasons; do not trust inverse dynamics in these frames",
                f"{int((reason_codes != 0).sum())} of {trial.frame_count} frames: {summary}",
            )
        file_points = trial.read_arrays(index).get("contact_points")
        if file_points is None:
            return
        distances = []
        for body in range(len(self.subject.contact_bodies)):
            file_point = file_points[:, 3 * body : 3 * body + 3]
            # Nine columns for each body: force, point, torque.
            written_point = forces.rows[:, 9 * body + 3 : 9 * body + 6]
            # Zeros mark frames without a centre of pressure.
            selected = file_point.any(axis=1) & (
                np.abs(forces.rows[:, 9 * body + 1]) > LOADED_FORCE_N
            )
            distances += np.linalg.norm(file_point - written_point, axis=1)[selected].tolist()
        errors: Mapping[str, Error] = {"point": Error.measure(distances, "m")} if distances else {}
        self.fidelity.add(
            "center-of-pressure",
            f"{trial_path}/ground_forces",
            "centres of pressure, which are zero in some frames of the file, and whose torque is parallel to the force",
            "computed from the measured force and moment, with a vertical torque; force, point and torque "
            "together give exactly the measured force and moment",
            errors=errors,
        )

    def _note_left_out(self, trial: B3dTrial, index: int, trial_path: str) -> None:
        """Note the arrays and passes of a trial that are not written."""
        available = [name for name in PASS_FIELDS.values() if name in trial.read_arrays(index)]
        derived = [
            name
            for name in available
            if name.startswith(("root_", "mass_center")) or name in DERIVED_FIELDS
        ]
        if derived:
            self.fidelity.add(
                "derived",
                f"{trial_path}/derived",
                "quantities that follow from coordinates, forces and model",
                f"{LEFT_OUT}; osimlite.read_b3d returns them",
                ", ".join(derived),
            )
        for pass_index, processing_pass in enumerate(trial.passes):
            if pass_index != index:
                self.fidelity.add(
                    "pass",
                    f"{trial_path}/passes/{pass_index}-{processing_pass.name}",
                    "several processing passes of a trial",
                    f"{LEFT_OUT}; select one with --processing-pass (processing_pass=)",
                    processing_pass.name,
                )


def _describe_reason(number: int) -> str:
    """Return why the forces of a frame are missing, in words."""
    return MISSING_FORCE_REASONS[number] if number < len(MISSING_FORCE_REASONS) else str(number)


def _describe_trial(trial: B3dTrial) -> dict[str, object]:
    """Return facts about a trial for the summary."""
    header = trial.header
    reason_codes = trial.missing_forces
    counts = Counter(int(reason) for reason in reason_codes if reason)
    return {
        "frames": trial.frame_count,
        "time_step_s": trial.time_step,
        "type": trial.type,
        "features": list(trial.features),
        "tags": list(header["tags"]),
        "original_name": header["original_name"],
        "split_index": header["split_index"],
        "marker_names_guessed": header["marker_names_guessed"],
        "force_plates": header["plate_count"],
        "missing_forces": {
            _describe_reason(number): count for number, count in sorted(counts.items())
        },
        "passes": [
            {
                "type": processing_pass.name,
                "lowpass_cutoff_hz": processing_pass.header["lowpass_cutoff"] or None,
                "unobserved_coordinates": sum(
                    not observed for observed in processing_pass.header["positions_observed"]
                ),
            }
            for processing_pass in trial.passes
        ],
    }


def _label_columns(header: Mapping[str, Any], key: str, axes: str, count: int) -> tuple[str, ...]:
    """Return labels of the columns of a sensor table, numbered where a name has several columns."""
    names = [str(name) or f"{key}_{index}" for index, name in enumerate(header[key])]
    if axes:
        return tuple(f"{name}_{axis}" for name in names for axis in axes)
    sizes: Sequence[int] = [count // len(names)] * len(names) if names else []
    # Only custom signals declare their sizes; the others have the same number of columns each.
    if key == "custom_names":
        sizes = header["custom_sizes"]
    return tuple(
        name if size == 1 else f"{name}_{index}"
        for name, size in zip(names, sizes, strict=True)
        for index in range(size)
    )


def _get_last_name(path: str) -> str:
    """Return the last name of a component path."""
    return str(path).rpartition("/")[2]


def _create_loads(bodies: Sequence[str]) -> ExternalLoads:
    """Return the document that applies the ground forces to their bodies."""
    loads = []
    for body in bodies:
        name = _get_last_name(body)
        loads.append(
            ExternalForce(
                name=f"ground_force_{name}",
                applied_to_body=name,
                force_expressed_in_body="ground",
                point_expressed_in_body="ground",
                force_identifier=f"ground_force_{name}_v",
                point_identifier=f"ground_force_{name}_p",
                torque_identifier=f"ground_torque_{name}_",
            )
        )
    return ExternalLoads(name="ground_forces", objects=loads, datafile=FORCES_FILE)


def _create_setups(
    name: str, model: str, loads: str, time_range: tuple[float, float], cutoff: float
) -> dict[str, InverseDynamicsTool | AnalyzeTool]:
    """Return the setups of a trial by their files.

    Args:
        name: name of the trial.
        model: path of the model from the folder of the trial.
        loads: file of the external loads; "" without loads.
        time_range: first and last time, s.
        cutoff: cutoff frequency of the filter of the coordinates, Hz; negative for no filter.
    """
    start, end = time_range
    return {
        INVERSE_DYNAMICS_FILE: InverseDynamicsTool(
            name=name,
            results_directory=RESULTS_FOLDER,
            model_file=model,
            time_range=(start, end),
            # OpenSim would let muscles act with their default activation, and the moments would
            # lack their part.
            forces_to_exclude=("Muscles",),
            external_loads_file=loads,
            coordinates_file=COORDINATES_FILE,
            lowpass_cutoff_frequency_for_coordinates=cutoff,
            output_gen_force_file="inverse_dynamics.sto",
        ),
        ANALYZE_FILE: AnalyzeTool(
            name=name,
            model_file=model,
            results_directory=RESULTS_FOLDER,
            initial_time=start,
            final_time=end,
            coordinates_file=COORDINATES_FILE,
            lowpass_cutoff_frequency_for_coordinates=cutoff,
            external_loads_file=loads,
            analysis_set=AnalysisSet(
                name="Analyses",
                objects=[
                    Kinematics(name="Kinematics", start_time=start, end_time=end),
                    BodyKinematics(name="BodyKinematics", start_time=start, end_time=end),
                ],
            ),
        ),
    }


def _write_document(path: Path, document: Any) -> Path:
    """Write a document of OpenSim.

    Returns:
        Path of the file.
    """
    write_atomically(path, to_text(document))
    return path
