"""Time the first and the later uses of commands in an environment.

    python benchmarks/first_use.py [--rounds N] [--without-compiler] [--first-only] PYTHON [NAME ...]

PYTHON is the Python of an environment in which osimlite is installed. In each round every command
gets an empty home folder, runs once without any cache, and runs twice more. The table gives the
medians of the rounds: wall time (processor time) of the first and of the faster later run, and the
ratio of their processor times. With NAMEs, only commands whose names contain one of them run.

Byte code exists before, as pip leaves it, except for the first command in an editable installation,
whose time is printed separately. With --without-compiler, the search path has only the programs of
the environment. Environments:

    python3.11 -m venv A && A/bin/pip install '.[all]'
    python3.11 -m venv B && B/bin/pip install -e '.[all]'
    python3.11 -m venv C && OSIMLITE_LIBRARY=no C/bin/pip install '.[all]'              numba alone
    python3.11 -m venv D && OSIMLITE_LIBRARY=no D/bin/pip install '.[sim,plot,view]'    Python alone

C and D need --without-compiler. The models and setups are those of the shared folder.
"""

from __future__ import annotations

import argparse
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

from _corpus import CORPUS, REFERENCE, WALKER, unpack_file, unpack_files

RAJAGOPAL = CORPUS / "m0954.osim.gz"

RESIDUAL_COORDINATES = (
    "pelvis_tx",
    "pelvis_ty",
    "pelvis_tz",
    "pelvis_list",
    "pelvis_tilt",
    "pelvis_rotation",
)
"""Coordinates of the pelvis, whose actuators RRA keeps small."""

RESIDUAL_FORCE = 8
"""Optimal force (N, N m) of the actuators of the pelvis."""

JOINT_FORCE = 300
"""Optimal force (N, N m) of all other actuators."""

MAX_LISTED_PACKAGES = 8
"""Number of the largest packages that are printed."""

LATER_RUNS = 2
"""Number of runs after the first; the faster one counts."""


class ProcessTime(NamedTuple):
    """Time of one process.

    Attributes:
        wall: wall time (s).
        processor: time of all processors (s).
    """

    wall: float
    processor: float


def write_rra_setup(folder: Path) -> None:
    """Write a setup of RRA to the folder of inverse kinematics.

    Every coordinate has an actuator and a task.

    Args:
        folder: folder with the model, the motion and the external loads.
    """
    text = (folder / "subject01_simbody.osim").read_text(encoding="utf-8")
    # Each name once, in the order of the file.
    names = list(dict.fromkeys(re.findall(r'<Coordinate name="([^"]+)"', text)))
    actuators = "".join(_format_actuator(name) for name in names)
    tasks = "".join(
        f'<CMC_Joint name="{name}"><on>true</on><weight>1</weight><active>true false false</active>'
        f"<kp>100 1 1</kp><kv>20 1 1</kv><ka>1 1 1</ka><coordinate>{name}</coordinate></CMC_Joint>"
        for name in names
    )
    tool = (
        "<model_file>subject01_simbody.osim</model_file><replace_force_set>true</replace_force_set>"
        "<force_set_files>actuators.xml</force_set_files><results_directory>rra</results_directory>"
        "<initial_time>0.5</initial_time><final_time>0.7</final_time>"
        "<external_loads_file>subject01_walk1_grf.xml</external_loads_file>"
        "<desired_kinematics_file>kinematics.mot</desired_kinematics_file>"
        "<task_set_file>tasks.xml</task_set_file><lowpass_cutoff_frequency>6</lowpass_cutoff_frequency>"
    )
    contents = {
        "actuators": f"<ForceSet><objects>{actuators}</objects></ForceSet>",
        "tasks": f"<CMC_TaskSet><objects>{tasks}</objects></CMC_TaskSet>",
        "rra": f'<RRATool name="subject01">{tool}</RRATool>',
    }
    for name, content in contents.items():
        document = f'<OpenSimDocument Version="40600">{content}</OpenSimDocument>\n'
        (folder / f"{name}.xml").write_text(document, encoding="utf-8")


def _format_actuator(coordinate: str) -> str:
    """Return the XML of the actuator of a coordinate."""
    force = RESIDUAL_FORCE if coordinate in RESIDUAL_COORDINATES else JOINT_FORCE
    return (
        f'<CoordinateActuator name="{coordinate}_drive"><coordinate>{coordinate}</coordinate>'
        "<min_control>-inf</min_control><max_control>inf</max_control>"
        f"<optimal_force>{force}</optimal_force></CoordinateActuator>"
    )


def prepare_files(folder: Path) -> None:
    """Write all files that the commands read to a folder."""
    for name in ("scale_gait2354", "ik_id_gait2354"):
        target = folder / name
        target.mkdir()
        unpack_files((REFERENCE / name).iterdir(), target)
    walk = folder / "ik_id_gait2354"
    unpack_file(
        REFERENCE / "models" / "gait2354_subject01_simbody.osim.gz", walk / "subject01_simbody.osim"
    )
    # Inverse dynamics reads the file that inverse kinematics writes.
    for name in ("kinematics.mot", "subject01_walk1_ik.mot"):
        shutil.copy(walk / "ik_accuracy_1e-9.mot", walk / name)
    write_rra_setup(walk)
    unpack_file(RAJAGOPAL, folder / "Rajagopal2016.osim")
    unpack_file(WALKER, folder / WALKER.name)


COMMANDS: dict[str, tuple[str, str]] = {
    "validate Rajagopal2016": (".", "validate --no-cache Rajagopal2016.osim"),
    "validate it unchanged": (".", "validate Rajagopal2016.osim"),
    # With --overwrite a later run may replace the results of the first.
    "run Scale": ("scale_gait2354", "run scale.xml --overwrite"),
    "run IK": ("ik_id_gait2354", "run subject01_Setup_IK.xml --overwrite"),
    "run ID": ("ik_id_gait2354", "run subject01_Setup_InverseDynamics.xml --overwrite"),
    "run RRA": ("ik_id_gait2354", "run rra.xml --overwrite"),
    "simulate Rajagopal2016": (".", "simulate Rajagopal2016.osim --to 0.1 -o results"),
    "simulate walker": (".", f"simulate {WALKER.name} --to 2 -o results"),
    "demo": (".", "demo -o demo --no-browser"),
}
"""Folder and arguments of each command, by name."""


def measure_process(
    command: Sequence[str], folder: Path, environment: dict[str, str], time_limit: float
) -> ProcessTime:
    """Run a process and return its time.

    Args:
        command: program and arguments.
        folder: working folder.
        environment: environment variables.
        time_limit: longest wall time (s).

    Raises:
        RuntimeError: the process failed; the message ends with its standard error.
    """
    # The usage of all children grows by that of the process that has just ended.
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    process = subprocess.run(
        command,
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=time_limit,
    )
    wall = time.perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    # Exit code 1 says that a command has worked and found something.
    if process.returncode not in (0, 1):
        raise RuntimeError(
            f"{command} ended with exit code {process.returncode}: {process.stderr.strip()}"
        )
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return ProcessTime(wall, processor)


def make_environment(home: Path, python: Path, without_compiler: bool) -> dict[str, str]:
    """Return the environment variables of a user.

    Args:
        home: home folder, which may be empty.
        python: Python of the environment.
        without_compiler: whether the search path has only programs of the environment.

    Returns:
        Variables by name; no others are inherited, because they may change what commands do.
    """
    # Programs of the environment are found first, as after its activation.
    path = str(python.parent)
    if not without_compiler:
        path = os.pathsep.join((path, os.environ.get("PATH", "")))
    return {"HOME": str(home), "PATH": path, "LANG": "C.UTF-8"}


def measure_command(
    name: str, files: Path, options: argparse.Namespace
) -> tuple[ProcessTime, ProcessTime | None]:
    """Measure a command once with an empty home folder.

    Args:
        name: name of the command in `COMMANDS`.
        files: folder with the files of `prepare_files`, which is copied.
        options: options of the command line.

    Returns:
        The time of the first use, and of the fastest later one unless that is not wanted.
    """
    subfolder, words = COMMANDS[name]
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder) / "home"
        home.mkdir()
        # Commands write their results beside the files, where the next round must not find them.
        work = shutil.copytree(files, Path(folder) / "files")
        python = find_python(options)
        environment = make_environment(home, python, options.without_compiler)
        # Otherwise numba saves kernels in the package, where the next round finds them.
        environment["NUMBA_CACHE_DIR"] = str(home / "kernels")
        command = [str(python), "-m", "osimlite", *words.split()]
        arguments = command, work / subfolder, environment, options.limit
        first = measure_process(*arguments)
        if options.first_only:
            return first, None
        # Other programs disturb the fastest run least.
        later = [measure_process(*arguments) for _ in range(LATER_RUNS)]
        return first, min(later)


def find_python(options: argparse.Namespace) -> Path:
    """Return the absolute path of the environment's Python.

    Links are not resolved: Python finds its environment by the folder of the link.
    """
    return Path(os.path.abspath(options.python))


def print_environment(console: Console, python: Path, without_compiler: bool) -> None:
    """Print what computes the kernels, and the size of the environment.

    Args:
        console: where to print.
        python: Python of the environment.
        without_compiler: whether the search path has only programs of the environment.
    """
    with tempfile.TemporaryDirectory() as home:
        environment = make_environment(Path(home), python, without_compiler)

        def run_python(*arguments: str) -> str:
            return subprocess.run(
                [str(python), *arguments],
                env=environment,
                # In an empty folder Python imports the osimlite of the environment, not that of the
                # working folder.
                cwd=home,
                capture_output=True,
                text=True,
                check=True,
            ).stdout

        program = (
            "import osimlite, sysconfig; print(osimlite.__file__, sysconfig.get_path('purelib'))"
        )
        package, site_packages = run_python("-c", program).split()
        sizes = {
            path.name: sum(file.stat().st_size for file in path.rglob("*") if file.is_file())
            for path in Path(site_packages).iterdir()
            if path.is_dir()
        }
        total = sum(sizes.values())
        console.print(f"{package}; site-packages {total / 1e6:.0f} MB", soft_wrap=True)
        largest = sorted(sizes.items(), key=lambda item: -item[1])[:MAX_LISTED_PACKAGES]
        words = ", ".join(f"{name} {size / 1e6:.0f}" for name, size in largest)
        console.print(f"largest, MB: {words}", soft_wrap=True)
        versions = run_python("-m", "osimlite", "--version", "-v")
        console.print(versions.strip(), soft_wrap=True)


def measure_first_command(python: Path, files: Path, options: argparse.Namespace) -> ProcessTime:
    """Measure the first command of all, which writes the byte code of an editable installation.

    Args:
        python: Python of the environment.
        files: folder with the files of `prepare_files`.
        options: options of the command line.
    """
    home = files / "home"
    home.mkdir()
    environment = make_environment(home, python, options.without_compiler)
    command = [str(python), "-m", "osimlite", "info", WALKER.name]
    return measure_process(command, files, environment, options.limit)


def make_row(name: str, files: Path, options: argparse.Namespace) -> list[str]:
    """Measure a command in all rounds, and return its row of the table.

    Args:
        name: name of the command in `COMMANDS`.
        files: folder with the files of `prepare_files`.
        options: options of the command line.
    """
    try:
        pairs = [measure_command(name, files, options) for _ in range(options.rounds)]
    # A command that is slow or fails must not hide the times of the others.
    except subprocess.TimeoutExpired:
        return [name, f"> {options.limit:g}"]
    except RuntimeError as error:
        print(error, file=sys.stderr)
        return [name, "failed"]
    cells = [_format_times([first for first, _ in pairs])]
    later = [times for _, times in pairs if times is not None]
    if later:
        ratios = [first.processor / other.processor for first, other in pairs if other is not None]
        cells += [_format_times(later), f"{median(ratios):.2f}"]
    return [name, *cells]


def _format_times(times: Sequence[ProcessTime]) -> str:
    """Return the median wall time and the median processor time (s)."""
    wall = median(one.wall for one in times)
    processor = median(one.processor for one in times)
    return f"{wall:.2f} ({processor:.2f})"


def parse_options() -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "python", type=Path, metavar="PYTHON", help="Python of the environment to measure"
    )
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help="measure only commands whose names contain this"
    )
    parser.add_argument(
        "--rounds", type=int, default=3, metavar="N", help="number of rounds, 3 by default"
    )
    parser.add_argument(
        "--without-compiler",
        action="store_true",
        help="leave out programs that are not of the environment",
    )
    parser.add_argument(
        "--first-only", action="store_true", help="do not run any command a second time"
    )
    parser.add_argument(
        "--limit",
        type=float,
        default=600.0,
        metavar="S",
        help="longest time of a command in seconds, 600 by default",
    )
    return parser.parse_args()


def main() -> None:
    """Run the command line."""
    options = parse_options()
    python = find_python(options)
    console = Console(width=110)
    print_environment(console, python, options.without_compiler)
    table = Table(
        title=f"First and later uses with {python}",
        caption=f"medians of {options.rounds} rounds; wall time (processor time)",
    )
    table.add_column("command")
    for heading in ("first, s", "later, s", "first / later"):
        table.add_column(heading, justify="right")
    with tempfile.TemporaryDirectory() as folder:
        files = Path(folder)
        prepare_files(files)
        first = measure_first_command(python, files, options)
        console.print(
            f"the first command, osimlite info: {first.wall:.2f} s ({first.processor:.2f} s)"
        )
        for name in COMMANDS:
            if not options.names or any(word in name for word in options.names):
                table.add_row(*make_row(name, files, options))
    console.print(table)


if __name__ == "__main__":
    main()
