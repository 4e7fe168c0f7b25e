"""Reflex walk: the jumper's body standing, and a scenario of SCONE with optimized parameters."""

from __future__ import annotations

from pathlib import Path

from osimlite.base.files import make_folder, read_file, write_atomically
from osimlite.errors import SettingError
from osimlite.io.document.printer import to_text
from osimlite.models.jumper import jumper
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.forces import HuntCrossleyForce
from osimlite.schema.model import Model

SCENARIO = "human-walks"
"""Name of the scenario, and of its files beside this module."""
ENDINGS = ".scone", ".zml", ".par"
"""Endings of the files: scenario, initial state, parameters."""
TRACK_RANGE_M = -5.0, 1000.0
"""Range of the horizontal position of the human (m)."""
STANDING = {
    "pelvis_tilt": -0.05, "pelvis_ty": 0.945, "hip_flexion_r": 0.1, "hip_flexion_l": 0.1, "knee_angle_r": -0.1,
    "knee_angle_l": -0.1, "ankle_angle_r": 0.05, "ankle_angle_l": 0.05,
}  # fmt: skip
"""Initial pose (rad, m)."""


def human() -> Model:
    """Build a human model with one ground reaction force per foot, as SCONE scenarios need it.

    Returns:
        The model.
    """
    model = jumper(driven=False)
    model.name = "Human"
    forces = {
        force.name: force
        for force in model.force_set.objects
        if isinstance(force, HuntCrossleyForce)
    }
    for side in "rl":
        heel = forces[f"heel_{side}_force"]
        ball = forces[f"ball_{side}_force"]
        (heel_parameters,), (ball_parameters,) = (
            heel.contact_parameters.objects,
            ball.contact_parameters.objects,
        )
        # SCONE expects one contact force per foot: heel and ball share it.
        heel_parameters.geometry = (*heel_parameters.geometry[:1], *ball_parameters.geometry)
        heel.name = f"foot_{side}"
        model.remove(ball)
    for coordinate in model.components(Coordinate):
        coordinate.default_value = STANDING.get(coordinate.name, 0.0)
        if coordinate.name == "pelvis_tx":
            coordinate.range = TRACK_RANGE_M
    return model


def write_scenario(folder: Path) -> Path:
    """Write the human and the scenario into a folder, where they can be run and changed.

    Args:
        folder: output folder; created if necessary.

    Returns:
        Path of the scenario.

    Raises:
        SettingError: the folder has a changed copy.
        OsimliteError: a file cannot be written.
    """
    make_folder(folder)
    files = {folder / "human.osim": to_text(human()).encode()}
    for ending in ENDINGS:
        files[folder / f"{SCENARIO}{ending}"] = (
            Path(__file__).with_name(f"{SCENARIO}{ending}").read_bytes()
        )
    for path, content in files.items():
        # All files are checked before any is written.
        if path.exists() and read_file(path) != content:
            raise SettingError(
                f"'{path}' exists already and has changes: run '{folder / SCENARIO}.scone', or name another folder"
            )
    for path, content in files.items():
        write_atomically(path, content)
    return folder / f"{SCENARIO}.scone"
