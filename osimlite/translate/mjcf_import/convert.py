"""Conversion of an MJCF file to an OpenSim model, in passes over a draft."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from osimlite.base.records import dataclass, field
from osimlite.errors import SettingError
from osimlite.io.document.printer import to_text
from osimlite.schema.frames import PhysicalOffsetFrame
from osimlite.schema.model import Model
from osimlite.simulation.robot.names import legal
from osimlite.translate.fidelity import Fidelity
from osimlite.translate.files import write_files
from osimlite.translate.mjcf.warnings import collect_warnings
from osimlite.translate.mjcf_import.actuators import add_actuators
from osimlite.translate.mjcf_import.bodies import add_bodies, add_markers
from osimlite.translate.mjcf_import.contacts import add_contacts
from osimlite.translate.mjcf_import.coordinate_map import CoordinateMap
from osimlite.translate.mjcf_import.draft import (
    Armature,
    ContactOption,
    ConversionDraft,
    ImportOptions,
    Limits,
    MuscleType,
    TendonPathOption,
    Up,
    vector,
)
from osimlite.translate.mjcf_import.equalities import add_equalities
from osimlite.translate.mjcf_import.joints import add_joint_forces
from osimlite.translate.mjcf_import.keyframes import add_keyframes
from osimlite.translate.mjcf_import.shapes import add_shapes, record_unseen
from osimlite.translate.mjcf_import.source import load_mjcf
from osimlite.translate.mjcf_import.tendons import add_tendon_paths


@dataclass(frozen=True, eq=False)
class Osim:
    """An MJCF file as an OpenSim model.

    Attributes:
        name: name of the files.
        model: converted model.
        fidelity: account of the objects of MuJoCo that were converted, and of those that OpenSim
            lacks.
        coordinates: map from MuJoCo's positions to values of coordinates.
        files: meshes and the table of keyframes, by name relative to the model.
    """

    name: str
    model: Model
    fidelity: Fidelity
    coordinates: CoordinateMap
    files: dict[str, str | bytes] = field(default_factory=dict)

    @property
    def text(self) -> str:
        """Text of the model in the .osim format."""
        return to_text(self.model)

    @property
    def summary(self) -> dict[str, object]:
        """Summary of the converted model.

        Returns:
            Numbers of components, by name, as plain data.
        """
        model = self.model
        return {
            "bodies": len(model.body_set.objects),
            "joints": len(model.joint_set.objects),
            "coordinates": sum(len(joint.coordinates) for joint in model.joint_set.objects),
            "forces": len(model.force_set.objects),
            "constraints": len(model.constraint_set.objects),
        }

    def write(self, folder: str | Path) -> list[Path]:
        """Write ``<name>.osim``, its meshes and ``fidelity.json`` into a folder.

        The folder is made if it does not exist.

        Returns:
            The files written, the model first.

        Raises:
            OsimliteError: a file cannot be written.
        """
        return write_files(
            Path(folder),
            {
                f"{self.name}.osim": self.text,
                **self.files,
                "fidelity.json": self.fidelity.to_json(),
            },
        )


PASSES: tuple[Callable[[ConversionDraft], None], ...] = (
    add_bodies,
    add_joint_forces,
    add_equalities,
    # Paths over obstacles start from the default pose, which a keyframe can set.
    add_keyframes,
    add_tendon_paths,
    add_actuators,
    add_markers,
    add_contacts,
    add_shapes,
    record_unseen,
)
"""Passes of a conversion in their order."""


def from_mjcf(
    path: str | Path,
    *,
    written_for: int | None = None,
    muscle_class: MuscleType = "millard",
    armature: Armature = "rotors",
    joint_limits: Limits = "forces",
    contacts: ContactOption = "forces",
    up: Up = "z",
    keyframe: str | None = None,
    tendon_paths: TendonPathOption = "wraps",
    name: str | None = None,
) -> Osim:
    """Convert an MJCF file, the format of MuJoCo, to an OpenSim model.

    MuJoCo itself compiles the file, so that it needs the extra ``mujoco``.

    Args:
        path: path of the file (.xml); included files and meshes are found by MuJoCo.
        written_for: version of MuJoCo that the file was written for, 3 (or older) or 4. It decides
            what a side site of a tendon means. It is required only where the meanings differ.
        muscle_class: ``"millard"`` makes rigid-tendon Millard muscles with fitted curves and activation
            dynamics; ``"exact"`` makes RigidTendonMuscles with MuJoCo's curves as formulas, whose
            control is the activation and which osimlite does not simulate.
        armature: ``"rotors"`` adds a rotor and a coupler for each joint with armature, ``"none"``
            leaves armature out.
        joint_limits: ``"forces"`` adds a CoordinateLimitForce for each limited joint, ``"range"`` only
            sets the range of the coordinate.
        contacts: ``"forces"`` makes contact surfaces and Hunt-Crossley forces, ``"geometry"`` the
            surfaces alone, ``"none"`` nothing.
        up: ``"z"`` keeps MuJoCo's axes, ``"y"`` turns the model so that y is up.
        keyframe: name of the keyframe that gives the default pose.
        tendon_paths: ``"wraps"`` makes GeometryPaths with wrap objects; ``"geodesics"`` makes
            Scholz2015GeometryPaths of those tendons that they follow within 1e-6 m in all sampled
            poses, and that wrap objects do not.
        name: name of the files to write, without suffix; that of the input if None.

    Returns:
        The model, the account of the conversion, and the files beside the model.

    Raises:
        MissingDependency: MuJoCo is not installed.
        MissingFileError: there is no such file.
        DocumentError: MuJoCo rejects the file.
        SettingError: an option has an unknown value, or `written_for` is required.
        UnsupportedError: the file has no body.
    """
    for option, value, choices in (
        ("written_for", written_for, (None, 2, 3, 4)),
        ("muscle_class", muscle_class, ("millard", "exact")),
        ("armature", armature, ("rotors", "none")),
        ("joint_limits", joint_limits, ("forces", "range")),
        ("contacts", contacts, ("forces", "geometry", "none")),
        ("up", up, ("y", "z")),
        ("tendon_paths", tendon_paths, ("wraps", "geodesics")),
    ):
        if value not in choices:
            allowed = " or ".join(f"'{choice}'" for choice in choices if choice is not None)
            raise SettingError(f"{option} must be {allowed}, not '{value}'")
    options = ImportOptions(
        # Versions before 3 follow the rules of version 3.
        written_for=None if written_for is None else max(written_for, 3),
        muscle=muscle_class,
        armature=armature,
        limits=joint_limits,
        contact=contacts,
        up=up,
        keyframe=keyframe,
        tendon_paths=tendon_paths,
    )
    draft = start_draft(Path(path), options)
    # MuJoCo also warns when it poses a model, for example of bodies that cannot start asleep.
    with collect_warnings(draft.source.mujoco) as warnings:
        for run_pass in PASSES:
            run_pass(draft)
    new_warnings = set(warnings) - set(draft.source.warnings)
    _record_warnings(draft.fidelity, sorted(new_warnings))
    return Osim(
        draft.source.path.stem if name is None else name,
        draft.model,
        draft.fidelity,
        CoordinateMap.build(draft.mj, draft.coordinates, draft.rotors),
        draft.files,
    )


def start_draft(path: Path, options: ImportOptions) -> ConversionDraft:
    """Compile a file, and start the draft of its OpenSim model.

    Returns:
        Draft with the settings of the file, and without bodies.
    """
    source = load_mjcf(path)
    mj_model: Any = source.model
    gravity = [float(value) for value in mj_model.opt.gravity]
    disabled = int(mj_model.opt.disableflags)
    if disabled & int(source.mujoco.mjtDisableBit.mjDSBL_GRAVITY):
        gravity = [0.0, 0.0, 0.0]
    if options.up == "y":
        # Z up becomes y up: (x, y, z) is (x, z, -y).
        gravity = [gravity[0], gravity[2], -gravity[1]]
    model = Model(
        name=legal(source.name),
        gravity=vector(gravity),
        credits=f"converted from {path.name} by osimlite",
        publications="",
    )
    world: Any = model.ground
    if options.up == "y":
        world = PhysicalOffsetFrame(
            name="world", socket_parent=model.ground, orientation=(-math.pi / 2.0, 0.0, 0.0)
        )
        model.add(world)
    fidelity = Fidelity(source.name, "osim")
    _record_warnings(fidelity, source.warnings)
    return ConversionDraft(source, options, model, fidelity, world)


def _record_warnings(fidelity: Fidelity, texts: Iterable[str]) -> None:
    """Record the warnings of MuJoCo."""
    for text in texts:
        fidelity.add(
            "warning", "/model", "a model about which MuJoCo warns", "used unchanged", text
        )
