"""Formats of other programs that are converted into files of OpenSim.

An importer is one entry of `IMPORTERS`: ``osimlite convert``, its help, its messages and its list of
formats follow from it. Each importer imports its modules in its function, because the entries are
also read to list the formats.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from osimlite.base.options import OptionSpec
from osimlite.base.reading import read_at_most
from osimlite.base.records import dataclass
from osimlite.translate.exporters import BVH_SCALE

if TYPE_CHECKING:
    from osimlite.translate.bvh import BvhMarkers
    from osimlite.translate.fidelity import Fidelity
    from osimlite.translate.mjcf_import.convert import Osim

BEGINNING_BYTES = 4096
"""Number of bytes at the beginning of a file that decide between formats with the same suffix."""

OSIM = "osim"
"""Name of OpenSim's model format."""

MARKERS = "trc"
"""Name of the target that is a file of markers (.trc)."""

PROJECT = "project"
"""Name of the target that is a folder with models, data and setup files of OpenSim."""


class Imported(Protocol):
    """Result of an importer.

    An importer of models also has an attribute `model`, so that the model can be written in any
    format of the exporters.
    """

    @property
    def fidelity(self) -> Fidelity:
        """Record of everything that was translated, approximated or left out."""

    @property
    def summary(self) -> Mapping[str, object]:
        """Facts for ``summary.json``; values are plain data."""

    def write(self, folder: str | Path) -> list[Path]:
        """Write the result into a folder, which is made if it does not exist; the main file is the first."""


@dataclass(frozen=True)
class Importer:
    """Declaration of a format that is read.

    The function takes the path of a file, the keyword argument `name`, which names the main file
    that is written (without suffix), and the options of the format. It returns an
    :class:`Imported`.
    """

    name: str  # name of the format in `osimlite convert --from`
    title: str  # name of the format in words
    suffixes: tuple[str, ...]  # suffixes of files in lower case
    target: str  # OSIM, MARKERS or PROJECT
    carries: str  # description of the content that is carried over
    read: Callable[..., Imported]
    # One of these texts occurs in the first BEGINNING_BYTES; empty if the suffix is enough.
    marks: tuple[bytes, ...] = ()
    choices: tuple[OptionSpec, ...] = ()


def read_mjcf(path: Path, *, written_for: str | None = None, **options: Any) -> Osim:
    """Return the OpenSim model converted from an MJCF file; see :func:`osimlite.from_mjcf`."""
    from osimlite.translate.mjcf_import.convert import from_mjcf

    version: Any = written_for
    if written_for is not None and written_for.isdecimal():
        version = int(written_for)
    return from_mjcf(path, written_for=version, **options)


MJCF_CHOICES = (
    OptionSpec(
        "written_for",
        # Text, so that a wrong value gets a message with the right ones.
        str | None,
        "The version of MuJoCo that the file was written for: 2, 3 or 4. Required if a side site "
        "of a tendon means something else in another version.",
        unit="VERSION",
        group="From MJCF",
    ),
    OptionSpec(
        "muscle_class",
        str | None,
        "'millard' makes Millard muscles with fitted curves, 'exact' makes RigidTendonMuscles with MuJoCo's "
        "curves and without activation dynamics.",
        default_text="millard",
        group="From MJCF",
    ),
    OptionSpec(
        "armature",
        str | None,
        "'rotors' adds a rotor and a coupler for each joint with armature, 'none' leaves it out.",
        default_text="rotors",
        group="From MJCF",
    ),
    OptionSpec(
        "joint_limits",
        str | None,
        "'forces' adds a CoordinateLimitForce for each limited joint, 'range' sets ranges only.",
        default_text="forces",
        group="From MJCF",
    ),
    OptionSpec(
        "contacts",
        str | None,
        "'forces' makes contact surfaces and Hunt-Crossley forces, 'geometry' only surfaces, 'none' "
        "neither.",
        default_text="forces",
        group="From MJCF",
    ),
    OptionSpec(
        "up",
        str | None,
        "'z' keeps MuJoCo's axes, 'y' turns the model so that y is up.",
        default_text="z",
        group="From MJCF",
    ),
    OptionSpec(
        "tendon_paths",
        str | None,
        "'wraps' makes paths with wrap objects, 'geodesics' paths over contact surfaces "
        "(Scholz2015GeometryPath) where these are nearer to MuJoCo's.",
        default_text="wraps",
        group="From MJCF",
    ),
    OptionSpec(
        "keyframe",
        str | None,
        "The keyframe that gives the default pose.",
        unit="NAME",
        default_text="qpos0",
        group="From MJCF",
    ),
)
"""Options of the conversion from MJCF."""


def read_subject(path: Path, *, name: str, processing_pass: str | None = None) -> Imported:
    """Return a subject of AddBiomechanics.

    See :class:`osimlite.translate.addbiomechanics.SubjectFolder`.
    """
    from osimlite.translate.addbiomechanics import SubjectFolder

    return SubjectFolder(path, name, processing_pass)


B3D_CHOICES = (
    OptionSpec(
        "processing_pass",
        str | None,
        "Write the trials of this processing pass: kinematics, dynamics, lowpass-filter or "
        "acceleration-minimizing-filter.",
        unit="TYPE",
        default_text="dynamics; the last pass if there is no such pass",
        group="AddBiomechanics",
    ),
)
"""Options of the format of AddBiomechanics."""


def read_bvh(path: Path, **options: Any) -> BvhMarkers:
    """Return the joint centres of a BVH file; see :class:`osimlite.translate.bvh.BvhMarkers`."""
    from osimlite.translate.bvh import BvhMarkers

    return BvhMarkers(path, **options)


IMPORTERS: list[Importer] = [
    Importer(
        "b3d",
        "AddBiomechanics",
        (".b3d",),
        PROJECT,
        "models, coordinates, markers, ground forces, plates, sensors, setups for OpenSim",
        read_subject,
        choices=B3D_CHOICES,
    ),
    Importer(
        "mjcf",
        "MJCF (MuJoCo)",
        (".xml", ".mjcf"),
        OSIM,
        "bodies, joints, constraints, muscles with wrapping, actuators, springs, contacts, meshes",
        read_mjcf,
        marks=(b"<mujoco",),
        choices=MJCF_CHOICES,
    ),
    Importer(
        "bvh",
        "BVH (Blender)",
        (".bvh",),
        MARKERS,
        "positions of joints as markers, for ik and fit; no rotations about bones",
        read_bvh,
        choices=(BVH_SCALE,),
    ),
]
"""All formats that are read, besides OpenSim's own; the order is that of the list of formats."""


def list_importers() -> dict[str, Importer]:
    """Collect all importers.

    Returns:
        Importers by the name of their format.
    """
    return {importer.name: importer for importer in IMPORTERS}


def find_format(path: Path) -> str | None:
    """Return the name of a file's format, by its suffix and its beginning; None if it is unknown.

    Raises:
        MissingFileError: the file does not exist or cannot be read.
    """
    suffix = path.suffix.lower()
    beginning = read_at_most(path, BEGINNING_BYTES)
    # Suffixes such as .xml are shared by formats, which the beginning tells apart.
    for importer in IMPORTERS:
        if suffix in importer.suffixes and _has_mark(beginning, importer.marks):
            return importer.name
    if suffix == ".osim" or _has_mark(beginning, (b"<OpenSimDocument",)):
        return OSIM
    return None


def _has_mark(beginning: bytes, marks: Iterable[bytes]) -> bool:
    """Return whether the beginning of a file contains one of the marks; True without marks."""
    marks = tuple(marks)
    return not marks or any(mark in beginning for mark in marks)
