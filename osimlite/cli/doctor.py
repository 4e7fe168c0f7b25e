"""``osimlite doctor``: installed packages, what each extra adds, and the folders in which it looks for mesh files."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from importlib import metadata
from pathlib import Path
from threading import Event, Lock
from typing import Annotated

from osimlite.base.cores import count_cores
from osimlite.base.named_tuples import NamedTuple
from osimlite.base.require import SAFE_PATH
from osimlite.base.text import format_count
from osimlite.cli._command import Argument, command
from osimlite.cli._console import add_row, create_table, print_table, say
from osimlite.cli._kernels import explain_kernels
from osimlite.cli._progress import progress_bar

NEEDS: dict[str, tuple[str, ...]] = {
    "build": (),
    "build human-walks": ("numpy",),
    "validate": (),
    "format": (),
    "upgrade": (),
    "diff": (),
    "info": (),
    "translate": ("numpy",),
    "convert": ("numpy",),
    "simulate": ("numpy",),
    "kinematics": ("numpy",),
    "modify": ("numpy",),
    "scale": ("numpy",),
    "ik": ("numpy",),
    "inverse-dynamics": ("numpy",),
    "static-optimization": ("numpy",),
    "fit": ("numpy",),
    "muscles": ("numpy",),
    "check-trial": ("numpy",),
    "scone": ("numpy",),
    "find-gait": ("numpy",),
    "run": ("numpy",),
    "view": ("numpy",),
    "gait": ("numpy",),
    "compiling kernels without a C++ compiler": ("numba",),
    "simulate --engine bullet": ("numpy", "pybullet"),
    "simulate --gui": ("numpy", "pybullet"),
    "simulate --plot": ("numpy", "matplotlib"),
    "gait --basin": ("numpy", "matplotlib"),
    "view --screenshot": ("numpy", "pillow"),
    "view --rerun": ("numpy", "rerun-sdk"),
    "simulate --animate": ("numpy", "pillow"),
    "osimlite.gym": ("gymnasium", "numpy"),
    "markers and forces of .c3d files": ("numpy", "ezc3d"),
    "osimlite.mjcf.Driver, translate --check, translate --to osim": ("mujoco", "numpy"),
    "osimlite.casadi": ("casadi", "numpy"),
    "models as YAML": ("pyyaml",),
    "trajectory.to_frame()": ("pandas",),
    "trajectory.to_arrow()": ("pyarrow",),
    "trajectory.to_xarray()": ("xarray", "pandas"),
    "sweep": ("numpy", "pyarrow", "filelock"),
    "optimize": ("numpy", "pyarrow", "filelock", "cma"),
    "the language server for editors": ("pygls",),
    "comparisons with OpenSim itself, in tests and benchmarks": ("opensim",),
}
"""Packages that a command, or one of its options, requires beyond the plain installation."""

EXTRAS = (
    "",
    "sim",
    "jit",
    "bullet",
    "view",
    "plot",
    "sweep",
    "optimize",
    "rerun",
    "lsp",
    "mujoco",
    "casadi",
    "gym",
    "c3d",
    "yaml",
    "frame",
    "oracle",
)
"""Extras in the order of the table, "" for the plain installation.

`all` and `dev` combine them; `fast` is the former name of `sim`.
"""

MESHES = (".vtp", ".stl", ".obj")
"""File name endings of meshes."""


_processes: set[subprocess.Popen[bytes]] = set()
"""Processes that import a package now."""
_stopped = Event()
"""Set after Ctrl-C: no further process is started."""
_process_lock = Lock()
"""Lock of `_processes` and `_stopped`, so that no process is started unrecorded or after Ctrl-C."""


class Package(NamedTuple):
    """Package that an extra requires.

    Attributes:
        name: name on the package index.
        version: installed version; empty if it is not installed.
        trouble: why the installed package cannot be imported; empty if it can.
    """

    name: str
    version: str
    trouble: str


@command
def doctor(
    model: Annotated[
        Path | None,
        Argument(
            help="A model file, or a folder: its settings and mesh folders are shown.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Show which packages are installed, what each extra adds, and in which folders mesh files are looked up.

    Exits with 1 if an installed package cannot be loaded.

    Example: osimlite doctor gait2392.osim
    """
    # rich is imported only where a table is printed, so that other commands start fast.
    from rich.text import Text

    from osimlite import __version__
    from osimlite.errors import MissingFileError

    if model is not None and not model.exists():
        raise MissingFileError("there is no such file or folder", file=str(model))
    say(f"osimlite {__version__}, Python {sys.version.split()[0]}, {sys.platform}")
    say(f"installed in {Path(__file__).parents[2]}")
    for sentence in explain_kernels():
        say(sentence)
    say()

    requirements = list_requirements()
    purposes = list_purposes(requirements)
    # A package may be in several extras, and is imported once.
    package_names = {name for names in requirements.values() for name in names}
    result = {}
    _stopped.clear()
    with (
        progress_bar("loading each package", len(package_names)) as progress,
        # Threads suffice, since each waits for a process; importing is bound by the disk.
        ThreadPoolExecutor(2 * count_cores()) as pool,
    ):
        # Each package is imported in a process of its own, several at a time.
        try:
            # Listing takes seconds on a slow disk; only the main thread notices Ctrl-C meanwhile.
            _list_modules(tuple(sys.path))
            for count, package in enumerate(pool.map(examine_package, package_names), 1):
                result[package.name] = package
                progress(count)
        except KeyboardInterrupt:
            pool.shutdown(wait=False, cancel_futures=True)
            # A library that is being loaded does not notice Ctrl-C, and takes seconds.
            _stop_processes()
            raise
    table = create_table()
    for heading in ("extra", "for", "packages"):
        table.add_column(heading, overflow="fold")
    for extra, names in requirements.items():
        packages = [result[name] for name in names]
        is_missing = any(not package.version for package in packages)
        package_texts = ", ".join(
            f"{package.name} {package.version or 'missing'}" for package in packages
        )
        add_row(table, extra or "(none)", ", ".join(purposes[extra]), package_texts)
        if extra and is_missing:
            table.add_row("", "", Text(f"pip install 'osimlite[{extra}]'", style="bold"))
    print_table(table)

    say()
    _print_mesh_folders(model)
    say()
    say("shell completion: osimlite --install-completion")
    broken_packages = [package for package in result.values() if package.trouble]
    for package in broken_packages:
        say(f"{package.name} {package.version} cannot be loaded: {package.trouble}")
    if broken_packages:
        raise SystemExit(1)


def list_requirements() -> dict[str, list[str]]:
    """Return the packages that each extra requires, from the metadata of the installation.

    Returns:
        Names of packages by extra, in the order of `EXTRAS`.
    """
    requirements: dict[str, list[str]] = {extra: [] for extra in EXTRAS}
    for line in metadata.requires("osimlite") or []:
        # A requirement begins with the name; version, extras and marker follow.
        name = re.split(r"[\s\[<>=!~;(]", line, maxsplit=1)[0]
        extra = re.search(r"extra\s*==\s*['\"]([^'\"]+)['\"]", line)
        group = extra[1] if extra else ""
        if group in requirements and name not in ("osimlite", *requirements[group]):
            requirements[group].append(name)
    return requirements


def list_purposes(requirements: dict[str, list[str]]) -> dict[str, list[str]]:
    """Return the uses that each extra enables: it is the first with all their packages.

    Args:
        requirements: packages by extra.

    Returns:
        Uses by extra, as in `NEEDS`.
    """
    result: dict[str, list[str]] = {extra: [] for extra in requirements}
    for use, packages in NEEDS.items():
        # The first extra in the order of the table is the smallest one.
        extra = next(
            (extra for extra, names in requirements.items() if {*packages} <= {*names}), None
        )
        if extra is not None:
            result[extra].append(use)
    return result


def find_extra(module: str | None, use: str = "") -> str | None:
    """Return the first extra that provides a module; None without one, or in a source tree that is not installed.

    Args:
        module: name of the missing module.
        use: use in `NEEDS`; the extra then has all packages of it.
    """
    # The names of modules that differ from those of their packages.
    name = {"PIL": "pillow", "yaml": "pyyaml"}.get(module or "", module)
    try:
        requirements = list_requirements()
    except metadata.PackageNotFoundError:
        # The missing module is what the user has to hear about.
        return None
    if name in NEEDS.get(use, ()):
        purposes = list_purposes(requirements)
        return next((extra for extra, uses in purposes.items() if use in uses), None)
    return next((extra for extra, names in requirements.items() if extra and name in names), None)


def examine_package(name: str) -> Package:
    """Find the version of a package, and import it in a separate process.

    A separate process is needed because some packages print when imported, and some end the process.

    Returns:
        Name and version of the package, and why it cannot be loaded; the version is empty if it is
        not installed.
    """
    try:
        version = metadata.version(name)
    except metadata.PackageNotFoundError:
        return Package(name, "", "")
    # The search path is a part of the key, so that a change of it is seen.
    modules = _list_modules(tuple(sys.path)).get(name.lower(), [])
    # The module with the package's name is the main one of several. A few packages have none: pillow
    # provides PIL, pyyaml provides yaml.
    main_module = name.lower().replace("-", "_")
    main = (
        main_module
        if main_module in modules
        else next(module for module in modules if not module.startswith("_"))
    )
    with _process_lock:
        if _stopped.is_set():
            return Package(name, version, "")
        process = subprocess.Popen(
            # -P: do not import from the current folder.
            [sys.executable, "-P", "-c", f"import {main}"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            # Some packages start processes or load libraries from the current folder, which may be untrusted.
            cwd=Path(__file__).parent,
            env={**os.environ, SAFE_PATH: "1"},
        )
        _processes.add(process)
    with process:
        _, errors = process.communicate()
        _processes.discard(process)
    if process.returncode == 0:
        return Package(name, version, "")
    error_lines = errors.decode(errors="replace").strip().splitlines() or [
        f"its process ended with exit code {process.returncode}"
    ]
    return Package(name, version, error_lines[-1])


def _stop_processes() -> None:
    """Kill all processes that import a package, and start no more."""
    with _process_lock:
        _stopped.set()
        for process in [*_processes]:
            process.kill()


@cache
def _list_modules(path: tuple[str, ...]) -> dict[str, list[str]]:
    """Return the importable modules of each package, by the package's name in lower case."""
    result: dict[str, list[str]] = {}
    # Sorted, so that the first module does not depend on the file system.
    for module, owners in sorted(metadata.packages_distributions().items()):
        for owner in owners:
            result.setdefault(owner.lower(), []).append(module)
    return result


def _print_mesh_folders(model: Path | None) -> None:
    """Print settings and mesh folders as `validate` and `translate` find them for a model or folder."""
    from osimlite.base.files import GEOMETRY_VARIABLE
    from osimlite.io.meshes.folders import MeshFolders
    from osimlite.lint.settings import load_settings

    folder = (
        Path.cwd()
        if model is None
        else model.resolve()
        if model.is_dir()
        else model.resolve().parent
    )
    settings = load_settings(folder)
    settings_file = (
        settings.file
        or "none (write them in pyproject.toml under tool.osimlite, or in osimlite.toml)"
    )
    say(f"settings: {settings_file}")
    say("mesh folders, in the order of the search:")
    for mesh_folder in MeshFolders(folder, settings.mesh_paths).searched:
        say(f"  {mesh_folder}: {_count_meshes(mesh_folder)}")
    if not os.environ.get(GEOMETRY_VARIABLE) and not settings.mesh_paths:
        say(
            "The bones of OpenSim's models are in the folder Geometry of its installation. Name it in the environment "
            f"variable {GEOMETRY_VARIABLE}, or as mesh-paths in the settings."
        )


def _count_meshes(folder: Path) -> str:
    if not folder.is_dir():
        return "does not exist"
    count = sum(path.suffix.lower() in MESHES for path in folder.iterdir())
    return f"{format_count(count, 'mesh file')}" if count else "no mesh files"
