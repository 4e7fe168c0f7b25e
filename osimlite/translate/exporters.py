"""Formats that a model can be written in, for other programs and for people.

An exporter is one entry of `EXPORTERS`: the options of ``osimlite translate`` and ``osimlite view``,
their help and their messages follow from it. Each exporter imports its modules in its function,
because the entries are also read to list the formats.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from osimlite.base.options import OptionSpec
from osimlite.base.records import dataclass

if TYPE_CHECKING:
    from osimlite.translate.biomod import BioMod
    from osimlite.translate.bvh import Bvh
    from osimlite.translate.export import Urdf
    from osimlite.translate.mjcf.export import Mjcf
    from osimlite.view.model_view import ModelView

SCREENSHOT_SIZE = (1200, 900)
"""Width and height of a screenshot, pixels."""


@dataclass(frozen=True)
class Exporter:
    """Declaration of a format.

    The function of an exporter of ``osimlite translate`` takes a model and its options, as
    :func:`osimlite.to_urdf` does, and returns an object with `write`, `fidelity` and `robot`, as
    :class:`osimlite.translate.export.Urdf` has them. That of ``osimlite view`` takes a
    :class:`osimlite.view.model_view.ModelView`, a path and its options, writes the file, and returns a
    sentence about it.
    """

    # Name of the format in `osimlite translate --to`, or of the option of `osimlite view` for the
    # file.
    name: str
    command: str  # "translate" or "view"; "convert" if only `osimlite convert` writes it
    help: str  # description of the written files
    write: Callable[..., Any]
    choices: tuple[OptionSpec, ...] = ()  # options that this format has
    is_default: bool = False  # whether the command writes it if no format is named
    title: str = ""  # name of the format in words; `name` in capitals if empty
    suffix: str = ""  # suffix of the main file, by which `osimlite convert` finds the format
    carries: str = ""  # description of the content that is carried over
    takes_motion: bool = False  # whether the function takes the keyword argument `motion`


def write_urdf(*model: Any, **options: Any) -> Urdf:
    """Return a model translated to URDF; see :func:`osimlite.to_urdf`."""
    # Importing a translator takes time, and each command needs at most one.
    from osimlite.translate.export import to_urdf

    return to_urdf(*model, **options)


def write_mjcf(*model: Any, **options: Any) -> Mjcf:
    """Return a model translated to MJCF; see :func:`osimlite.to_mjcf`."""
    from osimlite.translate.mjcf.export import to_mjcf

    return to_mjcf(*model, **options)


def write_bvh(*model: Any, **options: Any) -> Bvh:
    """Return a model and its motion as BVH; see :func:`osimlite.translate.bvh.to_bvh`."""
    from osimlite.translate.bvh import to_bvh

    return to_bvh(*model, **options)


def write_biomod(*model: Any, **options: Any) -> BioMod:
    """Return a model translated for biorbd; see :func:`osimlite.translate.biomod.to_biomod`."""
    from osimlite.translate.biomod import to_biomod

    return to_biomod(*model, **options)


def write_page(model_view: ModelView, path: Path) -> str:
    """Write a page for browsers.

    Returns:
        Path and size of the file, in words.
    """
    return f"{model_view.write_page(path)} ({_megabytes(path)})"


def write_glb(model_view: ModelView, path: Path) -> str:
    """Write a file of glTF.

    Returns:
        Path and size of the file, in words.
    """
    return f"{model_view.write_glb(path)} ({_megabytes(path)})"


def write_rerun(model_view: ModelView, path: Path) -> str:
    """Write a recording for the viewer of Rerun.

    Returns:
        Path and size of the file, and how to open it, in words.
    """
    return f"{model_view.write_rrd(path)} ({_megabytes(path)}); open it with: rerun {path}"


def write_screenshot(model_view: ModelView, path: Path, *, at: float | None) -> str:
    """Write a picture of the model at the time `at` (s).

    Returns:
        Path of the file.
    """
    return str(model_view.write_picture(path, SCREENSHOT_SIZE, at))


def _megabytes(path: Path) -> str:
    """Return the size of a file as text in megabytes."""
    return f"{path.stat().st_size / 1e6:.1f} MB"


URDF_CHOICES = (
    OptionSpec(
        "limits",
        str | None,
        "'range' writes coordinate ranges as hard limits; in OpenSim, ranges do not limit motions.",
        default_text="none",
        group="URDF",
    ),
    OptionSpec(
        "merge",
        bool | None,
        "Merge bodies that do not move relative to each other into one link.",
        group="URDF",
        spelled=("--merge",),
    ),
    OptionSpec(
        "collision",
        bool | None,
        "Write contact geometry as collision shapes (a half space as a large box).",
        group="URDF",
        spelled=("--collision",),
    ),
    OptionSpec(
        "effort",
        float | None,
        "Effort limit (N, N m) of joints whose actuators set no limit.",
        default_text="no limit",
        group="URDF",
    ),
    OptionSpec(
        "velocity",
        float | None,
        "Velocity limit (m/s, rad/s) of all joints.",
        default_text="no limit",
        group="URDF",
    ),
)
"""Options of the format URDF."""

MJCF_CHOICES = (
    OptionSpec(
        "mujoco", int | None, "The version to write for, 3 or 4.", default_text="4", group="MJCF"
    ),
    OptionSpec(
        "contact",
        str | None,
        "'native' writes contacts, whose forces follow MuJoCo's own law; 'none' leaves contacts out.",
        default_text="native",
        group="MJCF",
    ),
    OptionSpec(
        "fit",
        str | None,
        "'wraps' fits wrap surfaces to OpenSim's paths; 'force' also muscle forces (up to a minute).",
        default_text="none",
        group="MJCF",
    ),
    OptionSpec(
        "spline",
        str | None,
        "How to fit a spline that moves a joint: 'quartic', one polynomial of degree four, or 'series', two polynomials of "
        "degree four in a row: the result of the first is the input of the second.",
        default_text="series",
        group="MJCF",
    ),
    OptionSpec(
        "driver",
        bool | None,
        "Write a file without forces for osimlite.mjcf.Driver, which applies OpenSim's force laws.",
        group="MJCF",
        spelled=("--driver",),
    ),
)
"""Options of the format MJCF."""

BVH_SCALE = OptionSpec(
    "scale",
    float | None,
    "How many length units of the BVH file are one metre.",
    default_text="100, centimetres",
    group="BVH",
)
"""Option of the format BVH, for reading and writing."""

EXPORTERS: list[Exporter] = [
    Exporter(
        "urdf",
        "translate",
        "<file>.urdf, and <file>.coordinates.json, which describes how coordinates move joints if "
        "URDF cannot express this",
        write_urdf,
        URDF_CHOICES,
        is_default=True,
        suffix=".urdf",
        carries="bodies, joints, couplers, meshes, contact shapes; no muscles or springs",
    ),
    Exporter(
        "mjcf",
        "translate",
        "<file>.xml for MuJoCo",
        write_mjcf,
        MJCF_CHOICES,
        title="MJCF (MuJoCo)",
        suffix=".xml",
        carries="bodies, joints, constraints, muscles with wrapping, actuators, springs, contacts, meshes",
    ),
    Exporter(
        "bvh",
        "convert",
        "<file>.bvh for animation programs",
        write_bvh,
        (BVH_SCALE,),
        title="BVH (Blender)",
        suffix=".bvh",
        carries="skeleton and motion of all bodies; no masses, muscles or shapes",
        takes_motion=True,
    ),
    Exporter(
        "biomod",
        "convert",
        "<file>.bioMod for biorbd",
        write_biomod,
        title="bioMod (biorbd)",
        suffix=".bioMod",
        carries="bodies, joints, markers, muscles with via points; no wrapping, constraints or contacts",
    ),
    Exporter(
        "glb",
        "view",
        "Write a file for Blender, slides and web pages (glTF).",
        write_glb,
        title="glTF",
        suffix=".glb",
        carries="shapes of bodies and muscles, animation; no dynamics",
        takes_motion=True,
    ),
    Exporter(
        "html",
        "view",
        "Write one page that needs no server and no network.",
        write_page,
        title="web page",
        suffix=".html",
        carries="shapes, motion, component tree, findings",
        takes_motion=True,
    ),
    Exporter(
        "rerun",
        "view",
        "Write a recording for the Rerun viewer (.rrd).",
        write_rerun,
        title="Rerun",
        suffix=".rrd",
        carries="shapes of bodies and muscles, motion",
        takes_motion=True,
    ),
    Exporter(
        "screenshot",
        "view",
        "Write a picture (.png); needs no display.",
        write_screenshot,
        (
            OptionSpec(
                "at",
                float | None,
                "Time of the picture.",
                unit="SECONDS",
                default_text="the first",
            ),
        ),
        title="picture",
        suffix=".png",
        carries="one pose",
        takes_motion=True,
    ),
]
"""All formats; the order is that of the help."""


def list_exporters(command: str) -> dict[str, Exporter]:
    """List the exporters of a command, the default one first.

    Returns:
        Exporter by name.
    """
    selected = [exporter for exporter in EXPORTERS if exporter.command == command]
    # Sorting is stable: the other formats keep their order.
    # False sorts before True.
    selected.sort(key=lambda exporter: not exporter.is_default)
    return {exporter.name: exporter for exporter in selected}
