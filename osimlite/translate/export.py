"""Translation of a complete model to URDF: robot, text, mesh files, and account."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from osimlite.base.records import dataclass, field
from osimlite.base.text import format_count
from osimlite.errors import OsimliteError
from osimlite.io.meshes.folders import MeshFolders
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.extremes import any_numbers
from osimlite.schema.model import Model
from osimlite.simulation.robot.build import build_robot
from osimlite.simulation.robot.couplings import limit_to_ranges
from osimlite.simulation.robot.merge_fixed import merge_fixed
from osimlite.simulation.robot.mesh_files import MeshFiles
from osimlite.simulation.robot.names import legal, legal_names
from osimlite.simulation.robot.robot import Robot
from osimlite.simulation.robot.urdf import urdf_text
from osimlite.simulation.robot.visuals import Visuals, collect_visuals
from osimlite.translate.collisions import collect_collisions
from osimlite.translate.fidelity import Fidelity
from osimlite.translate.files import write_files
from osimlite.translate.sidecar import format_coordinates
from osimlite.translate.strength import add_strength_limits
from osimlite.translate.survey import record_losses

Limits = Literal["none", "range"]
Locked = Literal["fixed", "joint"]


@dataclass(frozen=True)
class Urdf:
    """Model as URDF.

    Attributes:
        name: name of the files.
        text: URDF text.
        fidelity: account of what became of every component, and of what URDF cannot express.
        robot: neutral robot that was written, which maps links and joints to bodies and
            coordinates.
        coordinates: JSON text with the functions from coordinates to joints, and the link of each
            body.
        files: mesh files that the text names, by name relative to it.
    """

    name: str
    text: str
    fidelity: Fidelity
    robot: Robot
    coordinates: str
    files: dict[str, bytes] = field(default_factory=dict)

    def __repr__(self) -> str:
        size = f"{len(self.text) / 1000.0:.0f} kB"
        return f"Urdf of '{self.name}': {size}, {format_count(len(self.files), 'further file')}"

    def write(self, folder: str | Path) -> list[Path]:
        """Write the URDF, its meshes, and files about coordinates and losses into a folder.

        The files are `<name>.urdf`, `<name>.coordinates.json` and `fidelity.json`.

        Args:
            folder: output folder; created if necessary.

        Returns:
            Paths of the files, the URDF first. It is written last, when all files that it needs
            exist.

        Raises:
            OsimliteError: a file cannot be written.
        """
        return write_files(
            Path(folder),
            {
                f"{self.name}.urdf": self.text,
                **self.files,
                f"{self.name}.coordinates.json": self.coordinates,
                "fidelity.json": self.fidelity.to_json(),
            },
        )


@any_numbers
def to_urdf(
    model: Model,
    *,
    visuals: bool = True,
    limits: Limits = "none",
    locked: Locked = "fixed",
    merge: bool = False,
    collision: bool = False,
    effort: float | None = None,
    velocity: float | None = None,
    folder: str | Path | None = None,
    geometry: Sequence[str | Path] = (),
    name: str | None = None,
) -> Urdf:
    """Translate a model to URDF.

    Args:
        model: model to translate.
        visuals: whether to write the shapes with which bodies are drawn.
        limits: "range" writes the ranges of coordinates as hard limits, "none" no limits; OpenSim
            itself lets coordinates leave their range.
        locked: "fixed" turns a locked coordinate into a fixed joint at its default value, "joint"
            into a joint that moves.
        merge: whether to merge bodies that do not move relative to each other into one link.
        collision: whether to write contact geometry as collision shapes; a half space becomes a box
            whose face is its surface.
        effort: effort limit (N or N·m) of joints whose coordinate has no actuators with a finite
            largest force; None for no limit.
        velocity: velocity limit (m/s or rad/s) of all joints; None for no limit.
        folder: folder of the model file; mesh files are searched there and in its folder
            `Geometry`.
        geometry: further folders for mesh files; those in the environment variable
            OSIMLITE_GEOMETRY, separated as in PATH, follow them.
        name: name of the files without ending; by default that of the model.

    Returns:
        URDF text with its mesh files, and the account of what became of every component.

    Raises:
        OsimliteError: a limit is not a positive number, or `limits` or `locked` has an unknown
            value.
        ModelError: the model is not a valid mechanism: a frame or body is missing or not connected.
        UnsupportedError: a joint or constraint is not supported.
    """
    if limits not in ("none", "range"):
        raise OsimliteError(f"limits must be 'none' or 'range', not '{limits}'")
    if locked not in ("fixed", "joint"):
        raise OsimliteError(f"locked must be 'fixed' or 'joint', not '{locked}'")
    for quantity, limit in (("effort", effort), ("velocity", velocity)):
        if limit is not None and not 0.0 < limit < math.inf:
            raise OsimliteError(
                f"a limit of {quantity} must be a positive number, not {limit:g}; leave it out for no limit"
            )
    # Options are checked before the model is built, which may take seconds.
    mechanism = build_mechanism(model)
    fidelity = Fidelity(mechanism.name, "urdf")
    # Meshes are searched beside the model, then in the named folders.
    mesh_folders = MeshFolders(None if folder is None else Path(folder), geometry)
    mesh_files = MeshFiles(mesh_folders)
    shapes = (
        collect_visuals(model, mechanism, fidelity.add, mesh_files=mesh_files)
        if visuals
        else Visuals()
    )
    collision_shapes = (
        collect_collisions(model, mechanism, fidelity, mesh_files) if collision else {}
    )
    robot = build_robot(
        mechanism, locked=locked, visuals=shapes.by_body, collisions=collision_shapes
    )
    # Merging comes before limits and names, which belong to the remaining links.
    if merge:
        robot = merge_fixed(robot)
    if limits == "range":
        robot = limit_to_ranges(robot)
    robot = add_strength_limits(
        legal_names(robot), model, fidelity, effort=effort, velocity=velocity
    )
    # The account is last: it needs final names, limits and shapes.
    record_losses(model, robot, fidelity)
    name = legal(model.name or "model") if name is None else name
    coordinates = format_coordinates(robot, f"{name}.urdf")
    return Urdf(name, urdf_text(robot), fidelity, robot, coordinates, mesh_files.files)
