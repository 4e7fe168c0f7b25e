"""First and later uses of commands in an environment: seconds of a user without any cache, and with it.

    python benchmarks/first_use.py [--rounds N] [--without-compiler] [--first-only] PYTHON [NAME ...]

PYTHON is that of an environment in which osimlite is installed. Each round gives every command a
home folder that is empty, runs it, and runs it again twice. Byte code is there, as pip leaves it,
but for the first command in an editable installation, which is told apart. With
--without-compiler no program but those of the environment is found. Environments:

    python3.11 -m venv A && A/bin/pip install '.[all]'
    python3.11 -m venv B && B/bin/pip install -e '.[all]'
    python3.11 -m venv C && OSIMLITE_LIBRARY=no C/bin/pip install '.[all]'              numba alone
    python3.11 -m venv D && OSIMLITE_LIBRARY=no D/bin/pip install '.[sim,plot,view]'    Python alone

For C and D give --without-compiler. The files are those of the reference data in the shared folder.
"""

from __future__ import annotations

import argparse
import gzip
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

SHARED = Path(__file__).resolve().parents[2] / "shared"
REFERENCE = SHARED / "oracle" / "tools" / "reference"
RAJAGOPAL = SHARED / "corpus" / "converted" / "m0954.osim.gz"
WALKER = Path(__file__).resolve().parents[1] / "fixtures" / "walker" / "DynamicWalkerModel.osim"
RESIDUALS = "pelvis_tx pelvis_ty pelvis_tz pelvis_list pelvis_tilt pelvis_rotation"


class Times(NamedTuple):
    """Seconds of one process: of the clock and of processors."""

    wall: float
    processor: float


def copy_plain(source: Path, target: Path) -> None:
    """Copy a file, uncompressed if its name ends with .gz."""
    content = source.read_bytes()
    target.write_bytes(gzip.decompress(content) if source.suffix == ".gz" else content)


def write_tracking(folder: Path) -> None:
    """Write a setup of RRA beside the files of inverse kinematics: every coordinate has an actuator and a task."""
    text = (folder / "subject01_simbody.osim").read_text(encoding="utf-8")
    names = list(dict.fromkeys(re.findall(r'<Coordinate name="([^"]+)"', text)))
    actuators = "".join(
        f'<CoordinateActuator name="{name}_drive"><coordinate>{name}</coordinate><min_control>-inf</min_control>'
        f"<max_control>inf</max_control><optimal_force>{8 if name in RESIDUALS.split() else 300}</optimal_force>"
        "</CoordinateActuator>"
        for name in names
    )
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
    for name, content in (
        ("actuators", f"<ForceSet><objects>{actuators}</objects></ForceSet>"),
        ("tasks", f"<CMC_TaskSet><objects>{tasks}</objects></CMC_TaskSet>"),
        ("rra", f'<RRATool name="subject01">{tool}</RRATool>'),
    ):
        document = f'<OpenSimDocument Version="40600">{content}</OpenSimDocument>\n'
        (folder / f"{name}.xml").write_text(document, encoding="utf-8")


def prepare_files(folder: Path) -> None:
    """Put all files that the commands read into a folder."""
    for name in ("scale_gait2354", "ik_id_gait2354"):
        target = folder / name
        target.mkdir()
        for file in (REFERENCE / name).iterdir():
            copy_plain(file, target / file.name.removesuffix(".gz"))
    walk = folder / "ik_id_gait2354"
    copy_plain(
        REFERENCE / "models" / "gait2354_subject01_simbody.osim.gz", walk / "subject01_simbody.osim"
    )
    # Inverse dynamics reads the file that inverse kinematics writes.
    for name in ("kinematics.mot", "subject01_walk1_ik.mot"):
        shutil.copy(walk / "ik_accuracy_1e-9.mot", walk / name)
    write_tracking(walk)
    copy_plain(RAJAGOPAL, folder / "Rajagopal2016.osim")
    copy_plain(WALKER, folder / WALKER.name)


COMMANDS: dict[str, tuple[str, str]] = {
    "validate Rajagopal2016": (".", "validate --no-cache Rajagopal2016.osim"),
    "validate it unchanged": (".", "validate Rajagopal2016.osim"),
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
    command: Sequence[str], folder: Path, environment: dict[str, str], limit: float
) -> Times:
    """Run a process, and return the time that it took.

    Raises:
        RuntimeError: it failed; the message ends with what it wrote to standard error.
    """
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(
        command,
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=limit,
    )
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode not in (0, 1):
        raise RuntimeError(
            f"{command} ended with exit code {done.returncode}: {done.stderr.strip()}"
        )
    return Times(wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


def make_environment(home: Path, python: Path, without_compiler: bool) -> dict[str, str]:
    """Return the variables of a user whose home folder is empty."""
    path = str(python.parent)
    if not without_compiler:
        path = os.pathsep.join((path, os.environ.get("PATH", "")))
    return {"HOME": str(home), "PATH": path, "LANG": "C.UTF-8"}


def measure_command(
    name: str, files: Path, options: argparse.Namespace
) -> tuple[Times, Times | None]:
    """Return the times of the first use of a command and of a later one."""
    place, words = COMMANDS[name]
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder) / "home"
        home.mkdir()
        work = shutil.copytree(files, Path(folder) / "files")
        python = find_python(options)
        environment = make_environment(home, python, options.without_compiler)
        # Beside the package, kernels that were compiled at first use would stay for the next round.
        environment["NUMBA_CACHE_DIR"] = str(home / "kernels")
        command = [str(python), "-m", "osimlite", *words.split()]
        arguments = command, work / place, environment, options.limit
        first = measure_process(*arguments)
        if options.first_only:
            return first, None
        later = [measure_process(*arguments) for _ in range(2)]
        return first, min(later)


def find_python(options: argparse.Namespace) -> Path:
    """Return the absolute path of the environment's Python; its link is what tells it the environment."""
    return Path(os.path.abspath(options.python))


def print_environment(console: Console, python: Path, without_compiler: bool) -> None:
    """Print what computes the kernels, and how large the environment is."""
    with tempfile.TemporaryDirectory() as home:
        environment = make_environment(Path(home), python, without_compiler)
        where = (
            "import osimlite, sysconfig; print(osimlite.__file__, sysconfig.get_path('purelib'))"
        )
        run = [str(python), "-c", where]
        done = subprocess.run(
            run, env=environment, cwd=home, capture_output=True, text=True, check=True
        )
        package, site = done.stdout.split()
        sizes = {
            path.name: sum(file.stat().st_size for file in path.rglob("*") if file.is_file())
            for path in Path(site).iterdir()
            if path.is_dir()
        }
        console.print(
            f"{package}; site-packages {sum(sizes.values()) / 1e6:.0f} MB", soft_wrap=True
        )
        largest = sorted(sizes.items(), key=lambda item: -item[1])[:8]
        words = ", ".join(f"{name} {size / 1e6:.0f}" for name, size in largest)
        console.print(f"largest, MB: {words}", soft_wrap=True)
        version = [str(python), "-m", "osimlite", "--version", "-v"]
        done = subprocess.run(
            version, env=environment, cwd=home, capture_output=True, text=True, check=True
        )
        console.print(done.stdout.strip(), soft_wrap=True)


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("python", type=Path, metavar="PYTHON")
    parser.add_argument("names", nargs="*", metavar="NAME", help="only commands with these words")
    parser.add_argument("--rounds", type=int, default=3, metavar="N", help="3 by default")
    parser.add_argument("--without-compiler", action="store_true", help="hide all other programs")
    parser.add_argument("--first-only", action="store_true", help="do not run a command again")
    parser.add_argument(
        "--limit", type=float, default=600.0, metavar="S", help="longest time of a command"
    )
    options = parser.parse_args()
    python = find_python(options)
    console = Console(width=110)
    print_environment(console, python, options.without_compiler)
    table = Table(
        title=f"First and later uses with {python}",
        caption=f"s, medians of {options.rounds}; wall (processor)",
    )
    table.add_column("")
    for heading in ("first", "later", "first / later"):
        table.add_column(heading, justify="right")
    with tempfile.TemporaryDirectory() as name:
        files = Path(name)
        prepare_files(files)
        home = Path(name) / "home"
        home.mkdir()
        environment = make_environment(home, python, options.without_compiler)
        command = [str(python), "-m", "osimlite", "info", WALKER.name]
        took = measure_process(command, files, environment, options.limit)
        console.print(f"the first command, osimlite info: {took.wall:.2f} s ({took.processor:.2f})")
        for chosen in COMMANDS:
            if options.names and not any(word in chosen for word in options.names):
                continue
            try:
                pairs = [measure_command(chosen, files, options) for _ in range(options.rounds)]
            except subprocess.TimeoutExpired:
                table.add_row(chosen, f"> {options.limit:g}")
                continue
            except RuntimeError as error:
                table.add_row(chosen, "failed")
                print(error, file=sys.stderr)
                continue
            cells = [
                f"{median(one.wall for one in times):.2f} ({median(one.processor for one in times):.2f})"
                for times in zip(*pairs, strict=True)
                if times[0] is not None
            ]
            if not options.first_only:
                cells.append(
                    f"{median(a.processor / b.processor for a, b in pairs if b is not None):.2f}"
                )
            table.add_row(chosen, *cells)
    console.print(table)


if __name__ == "__main__":
    main()
