"""Damage files at random, run a command on each, and look for crashes, hangs and changed files.

One process serves all commands and is restarted when it dies or hangs, so that thousands of
commands take minutes. `python -m tests.hostile.mutations 500 [--seed 7] [.mot ...]` prints a table
of all kinds of files, or of the named ones.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import re
import select
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import osimlite

ROOT = Path(osimlite.__file__).parents[1]
FIXTURES = ROOT / "fixtures"

HANG_SECONDS = 10.0
"""Processor time (s) of a command above which it counts as a hang."""

SEARCH_SECONDS = 60.0
"""Processor time (s) above which solving a Moco study counts as a hang.

It is longer because a study limits its own number of iterations.
"""

# How a command ends that another program has stopped by SIGTERM.
TERMINATED = "crash -15"

WALL_SECONDS = 240.0
"""Wall-clock time (s) after which a command is stopped; it allows for a busy machine."""

# Program of the server: it runs each command that it reads, and prints how the command ended.
SERVER = """
import contextlib, io, json, os, resource, sys, time, traceback
from osimlite.cli import main
for line in sys.stdin:
    folder, order = json.loads(line)
    os.chdir(folder)
    begin, out, code = time.process_time(), io.StringIO(), None
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
            main(order)
    except SystemExit as error:
        code = error.code
    except BaseException:
        code = "traceback: " + traceback.format_exc()[-600:]
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = time.process_time() - begin + after.ru_utime - spent.ru_utime
    text = out.getvalue()
    if "Traceback" in text:
        code = "traceback: " + text[-600:]
    print("ANSWER" + json.dumps([code, used, text[-300:]]), file=sys.__stdout__, flush=True)
"""


class Kind(NamedTuple):
    """Kind of files: files to be damaged, further files in their folder, and commands that read them."""

    ending: str
    sources: tuple[str, ...]  # paths below the fixtures
    beside: tuple[str, ...]  # paths below the fixtures, or @NAME for a file of `_made`
    commands: tuple[tuple[str, ...], ...]  # @ stands for the damaged file


_PENDULUM = ("pipelines/pendulum/model.osim",)
_SLIDE = ("setups/slide.osim", "setups/slide_guess.sto", "setups/slide_states.sto")
_IMU = ("pipelines/pendulum/orientations.sto", "pipelines/pendulum/angles.sto")
_OUT = ("-o", "out")

# Kinds of files by their endings.
KINDS = {
    ".c3d": Kind(
        ".c3d",
        ("trials/force_plate.c3d", "trials/two_markers.c3d", "trials/no_plate.c3d"),
        ("@markers.osim",),
        (("ik", "markers.osim", "@", *_OUT),),
    ),
    ".b3d": Kind(".b3d", ("@b3d",), (), (("convert", "@", *_OUT),)),
    ".bvh": Kind(".bvh", ("@bvh",), (), (("convert", "@", *_OUT),)),
    ".trc": Kind(
        ".trc",
        ("@trc", "setups/walk.trc"),
        _PENDULUM,
        (("validate", "@", "--no-cache"), ("ik", "model.osim", "@", *_OUT)),
    ),
    ".mot": Kind(
        ".mot",
        ("@angles", "setups/coords.mot"),
        _PENDULUM,
        (("validate", "@", "--no-cache"), ("inverse-dynamics", "model.osim", "@", *_OUT)),
    ),
    ".xml": Kind(
        ".xml",
        ("@id", "pipelines/pendulum/imu_placer.xml", "setups/ik.xml", "setups/loads.xml"),
        (*_PENDULUM, *_IMU, "@motion.sto"),
        (("validate", "@", "--no-cache"), ("run", "@", *_OUT)),
    ),
    ".omoco": Kind(
        ".omoco",
        ("setups/slide.omoco",),
        _SLIDE,
        (("validate", "@", "--no-cache"), ("run", "@", *_OUT)),
    ),
    ".scone": Kind(
        ".scone",
        ("@scone",),
        ("@human.osim", "@human-walks.zml", "@human-walks.par"),
        (("scone", "@", "--to", "0.05", *_OUT),),
    ),
    ".yaml": Kind(".yaml", ("@yaml",), (), (("build", "@", "-o", "built.osim"),)),
    ".vtp": Kind(
        ".vtp",
        ("meshes",),
        (*_PENDULUM, "@mesh.osim"),
        (("validate", "mesh.osim", "--no-cache"), ("view", "mesh.osim", "--html", "page.html")),
    ),
}

ANGLES = (
    "motion\nversion=1\nnRows=12\nnColumns=3\ninDegrees=no\nendheader\ntime\tq0\tq1\n"
    + "".join(f"{0.1 * k:.1f}\t{0.01 * k * k:.4f}\t0.1\n" for k in range(12))
)
SETUP = """<OpenSimDocument Version="40600"><InverseDynamicsTool name="swing">
<results_directory>out</results_directory><model_file>model.osim</model_file>
<time_range>0 1</time_range><coordinates_file>motion.sto</coordinates_file>
<output_gen_force_file>forces.sto</output_gen_force_file>
</InverseDynamicsTool></OpenSimDocument>
"""
MARKERS = (
    "PathFileType\t4\t(X/Y/Z)\tit.trc\n"
    "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n"
    "100\t100\t5\t2\tm\t100\t1\t5\nFrame#\tTime\tm0\t\t\tm1\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n"
) + "".join(
    f"{k + 1}\t{0.01 * k:.2f}\t0.1\t-0.5\t0\t0.2\t-{1.0 + 0.01 * k:.2f}\t0\n" for k in range(5)
)
SKELETON = """HIERARCHY
ROOT hip
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT knee
  {
    OFFSET 0 -40 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 -40 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.01
1 2 3 10 20 30 5 6 7
1 2 4 10 21 30 5 6 8
"""
MESH_MODEL = """<OpenSimDocument Version="40600"><Model name="m"><Ground name="ground"><attached_geometry>
<Mesh name="g"><mesh_file>it.vtp</mesh_file></Mesh></attached_geometry></Ground></Model></OpenSimDocument>
"""

# Pieces that are inserted into files.
TOKENS = (
    b"<", b">", b"\0", b"\xff", b"nan", b"inf", b"-1", b"1e400", b"9" * 30, b"&", b"\"", b"\t", b"\n", b"{", b"}",
    b"[", b"]", b"..", b"/", b"<!--", b"<![CDATA[", b": &a *a", b"\xef\xbb\xbf", b"0", b" ",
)  # fmt: skip


VALUES = (
    b"0", b"-1", b"1e308", b"-1e308", b"1e-320", b"nan", b"inf", b"-inf", b"9" * 30, b"1e9", b"2147483648", b"", b"x",
    b"0 0", b"true", b"../..", b"/", b"a b", b"1.5", b"0.001", b"1e6",
)  # fmt: skip
"""Values that replace numbers and names."""

# Numbers and names in XML, tables and scenarios.
_WORD = re.compile(
    rb"(?<=>)[^<>\s][^<>]*(?=<)|(?<=[\s=:{\[,~\"])[-+]?[0-9][0-9.e+-]*|(?<== )[\w./*]+"
)


def damage(data: bytes, rng: random.Random) -> bytes:
    """Return a file with one to four random changes.

    Changes replace bytes, or remove, repeat, move or replace pieces of the file by tokens.
    """
    result = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        size = len(result)
        # Half of the changes are near the beginning, where headers are.
        place = rng.randrange(min(size, 600) if rng.random() < 0.5 else size) if size else 0
        if rng.random() < 0.5 and (spans := [*_WORD.finditer(result)]):
            # Replace a number or name by another one, so that the file stays well-formed.
            start, stop = rng.choice(spans).span()
            result[start:stop] = rng.choice((*VALUES, rng.choice(spans)[0]))
            continue
        end = min(size, place + rng.choice((1, 1, 2, 4, 8, 64, 512)))
        match rng.randrange(7):
            case 0 if size:
                result[place] = rng.randrange(256)
            case 1:
                del result[place:end]
            case 2:
                result[place:place] = result[place:end] * rng.choice((1, 3, 50))
            case 3:
                result[place:end] = rng.choice(TOKENS)
            case 4:
                result[place:place] = rng.choice(TOKENS)
            case 5 if rng.random() < 0.3:
                del result[place:]
            case _:
                other = rng.randrange(size) if size else 0
                result[place:place] = result[other : other + 32]
    return bytes(result)


class Server:
    """Process that runs commands with a private cache, and is restarted after a crash or a hang."""

    def __init__(self) -> None:
        self._cache = tempfile.TemporaryDirectory()
        self._process: subprocess.Popen[str] | None = None

    def run(self, words: list[str], folder: Path) -> tuple[str, float, str]:
        """Run a command in a folder.

        Returns:
            The exit code or how the process ended, its processor time (s), and its last output.
        """
        if self._process is None:
            environment = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
            environment |= {"XDG_CACHE_HOME": self._cache.name}
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", SERVER],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                text=True,
                env=environment,
            )
        process = self._process
        assert process.stdin is not None and process.stdout is not None
        process.stdin.write(json.dumps([str(folder), words]) + "\n")
        process.stdin.flush()
        deadline = time.monotonic() + WALL_SECONDS
        while time.monotonic() < deadline:
            if not select.select([process.stdout], [], [], 1.0)[0]:
                continue
            line = process.stdout.readline()
            if not line:
                self.end()
                return f"crash {process.wait()}", 0.0, ""
            if line.startswith("ANSWER"):
                code, used, text = json.loads(line[6:])
                return str(code), used, text
        self.end()
        return "hang", WALL_SECONDS, ""

    def close(self) -> None:
        """End the process and remove its cache."""
        self.end()
        self._cache.cleanup()

    def end(self) -> None:
        """End the process; the next command starts another one."""
        if self._process is not None:
            self._process.kill()
            # Leaving the context closes the pipes and waits for the process.
            with self._process:
                pass
            self._process = None


def run_kind(
    name: str, count: int, server: Server, seed: int = 1
) -> tuple[Counter[str], list[str]]:
    """Damage files of a kind and run its commands on them.

    Args:
        name: file ending, which is the name of the kind.
        count: number of damaged files.
        server: process that runs the commands.
        seed: seed of the random changes.

    Returns:
        How often commands ended in each way, and a line for each fault: a traceback, a crash, a
        hang or a file that was changed.
    """
    kind, rng, faults, counts = (
        KINDS[name],
        random.Random(f"{name} {seed}"),
        list[str](),
        Counter[str](),
    )
    with tempfile.TemporaryDirectory() as top:
        folder, outside = Path(top, "work", "in"), Path(top, "outside")
        folder.mkdir(parents=True)
        outside.mkdir()
        (outside / "precious.txt").write_text("precious")
        sources = _sources(kind)
        for beside in kind.beside:
            if beside.startswith("@"):
                (folder / beside[1:]).write_bytes(_made(beside[1:]))
            else:
                shutil.copy(FIXTURES / beside, folder)
        for number in range(count):
            data = damage(rng.choice(sources), rng)
            file = folder / f"it{kind.ending}"
            file.write_bytes(data)
            before = _digests(Path(top))
            for command in kind.commands:
                code, used, text = server.run(
                    [file.name if word == "@" else word for word in command], folder
                )
                if code == TERMINATED:
                    # This program does not send SIGTERM, so another one has ended the process.
                    # Repeat the command.
                    code, used, text = server.run(
                        [file.name if word == "@" else word for word in command], folder
                    )
                # A study iterates as long as it specifies, and no damage makes that endless. Allow
                # more time.
                limit = SEARCH_SECONDS if name == ".omoco" and command[0] == "run" else HANG_SECONDS
                is_good = code in ("0", "1", "2") and used <= limit
                counts[code if is_good else "fault"] += 1
                if not is_good:
                    faults.append(f"{name} {number} {command[0]}: {code} {used:.1f} s {text}")
                    _keep(file, number)
            after = _digests(Path(top))
            if changed := [path for path, digest in before.items() if after.get(path) != digest]:
                faults.append(f"{name} {number}: changed {changed}")
            for path in set(after) - set(before):
                if not path.startswith(
                    ("work/in/out", "work/in/built.osim", "work/in/page.html", "cache")
                ):
                    faults.append(f"{name} {number}: wrote {path}")
                if not path.startswith("cache"):
                    Path(top, path).unlink()
    return counts, faults


def _sources(kind: Kind) -> list[bytes]:
    result = []
    for source in kind.sources:
        if source.startswith("@"):
            result.append(_made(source[1:]))
        elif (FIXTURES / source).is_dir():
            result += [
                path.read_bytes() for path in sorted((FIXTURES / source).rglob(f"*{kind.ending}"))
            ]
        else:
            result.append((FIXTURES / source).read_bytes())
    return result


def _made(name: str) -> bytes:
    """Return the content of a file that is not among the fixtures."""
    from osimlite.io.document.data import to_yaml
    from osimlite.models.walking import human

    walking = ROOT / "osimlite" / "models" / "walking"
    match name:
        case "angles" | "motion.sto":
            return ANGLES.encode()
        case "trc":
            return MARKERS.encode()
        case "id":
            return SETUP.encode()
        case "markers.osim":
            # The marker names must be those in the marker file.
            text = (FIXTURES / _PENDULUM[0]).read_text()
            return text.replace('"m0"', '"one"').replace('"m1"', '"two"').encode()
        case "mesh.osim":
            return MESH_MODEL.encode()
        case "b3d":
            from tests.io.b3d_files import make_subject

            return make_subject((4, 3))
        case "bvh":
            return SKELETON.encode()
        case "yaml":
            return to_yaml(osimlite.read(FIXTURES / _PENDULUM[0])).encode()
        case "human.osim":
            return osimlite.to_text(human()).encode()
        case "scone":
            return (walking / "human-walks.scone").read_bytes()
        case _:
            return (walking / name).read_bytes()


def _digests(top: Path) -> dict[str, str]:
    files = (
        path
        for path in top.rglob("*")
        if path.is_file() and "cache" not in path.relative_to(top).parts
    )
    return {
        path.relative_to(top).as_posix(): hashlib.md5(path.read_bytes()).hexdigest()
        for path in files
    }


def _keep(file: Path, number: int) -> None:
    """Save a file with a fault into the folder that the user named, if any."""
    if folder := os.environ.get("OSIMLITE_KEEP_MUTATIONS"):
        Path(folder).mkdir(parents=True, exist_ok=True)
        shutil.copy(file, Path(folder, f"{number}{file.suffix}"))


def main() -> None:
    """Print a table of all kinds of files, or of the named ones."""
    parser = argparse.ArgumentParser()
    parser.add_argument("count", type=int)
    parser.add_argument("names", nargs="*", default=list(KINDS))
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_intermixed_args()
    count = chosen.count
    server = Server()
    for name in chosen.names:
        begin = time.monotonic()
        counts, faults = run_kind(name, count, server, chosen.seed)
        ends = ", ".join(f"{counts[code]} x {code}" for code in sorted(counts))
        sys.stdout.write(
            f"{name:8} {count} mutations: {ends}; {len(faults)} faults ({time.monotonic() - begin:.0f} s)\n"
        )
        sys.stdout.write("".join(f"    {fault}\n" for fault in faults[:20]))
        sys.stdout.flush()
    server.close()


if __name__ == "__main__":
    main()
