"""Build the wheels of a release for all platforms on one machine, and check what is in them.

    pip install build hatchling pydantic ziglang
    python packaging/wheels.py dist/osimlite-0.1.0.tar.gz dist [PLATFORM ...]

Zig's C++ compiler (the package `ziglang`) compiles for every platform. Each wheel is checked: its
libraries are of the right format, export every kernel, and ask for no newer glibc than the tag of
the wheel says.
"""

from __future__ import annotations

import json
import os
import re
import struct
import subprocess
import sys
import zipfile
from pathlib import Path

PLATFORMS = {
    "manylinux_2_17_x86_64": "x86_64-linux-gnu.2.17",
    "manylinux_2_17_aarch64": "aarch64-linux-gnu.2.17",
    "macosx_11_0_arm64": "aarch64-macos.11.0",
    "macosx_11_0_x86_64": "x86_64-macos.11.0",
    "win_amd64": "x86_64-windows-gnu",
}
"""Platforms of the wheels, as in their tags, each with Zig's name for it."""

MACHINES = {
    # Format: where the number of the processor is in the file, and which numbers mean which
    # processor.
    "linux": (b"\x7fELF", 18, "<H", {62: "x86_64", 183: "aarch64"}),
    "macosx": (b"\xcf\xfa\xed\xfe", 4, "<I", {0x01000007: "x86_64", 0x0100000C: "aarch64"}),
    "win": (b"MZ", None, "<H", {0x8664: "x86_64"}),
}
"""How libraries of each system begin."""

TABLE_START = b'{"version":'
"""How the table of a library begins."""


def build_wheel(source: Path, folder: Path, platform: str) -> Path:
    """Build the wheel of one platform from the source distribution.

    Args:
        source: the source distribution.
        folder: where the wheel goes.
        platform: one of `PLATFORMS`.

    Returns:
        The wheel.
    """
    compiler = f"{sys.executable} -m ziglang c++ -target {PLATFORMS[platform]}"
    environment = {**os.environ, "CXX": compiler, "OSIMLITE_PLATFORM": platform}
    command = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "--quiet",
        "--no-deps",
        "--no-build-isolation",
        "--wheel-dir",
    ]
    subprocess.run([*command, str(folder), str(source)], env=environment, check=True)
    (wheel,) = folder.glob(f"*-{platform}.whl")
    return wheel


def check_wheel(wheel: Path) -> list[str]:
    """Return what is wrong with a wheel, in sentences; nothing if it is as its tag says."""
    platform = wheel.stem.rpartition("-")[2]
    suffix = {"macosx": ".dylib", "win": ".dll"}.get(platform.partition("_")[0], ".so")
    with zipfile.ZipFile(wheel) as archive:
        names = [name for name in archive.namelist() if name.startswith("osimlite/native/")]
        wanted = {"kernels-baseline" + suffix}
        if platform.endswith(("x86_64", "amd64")):
            wanted.add("kernels-x86-64-v3" + suffix)
        found = {Path(name).name for name in names}
        problems = (
            []
            if found == wanted
            else [f"expected the libraries {sorted(wanted)}, found {sorted(found)}"]
        )
        for name in names:
            problems += [
                f"{name}: {problem}" for problem in check_library(archive.read(name), platform)
            ]
    return problems


def check_library(content: bytes, platform: str) -> list[str]:
    """Return what is wrong with a library, in sentences.

    Args:
        content: of the file.
        platform: of the wheel that it is in.
    """
    system = platform.partition("_")[0].replace("manylinux", "linux")
    machine = "aarch64" if platform.endswith(("aarch64", "arm64")) else "x86_64"
    magic, offset, form, numbers = MACHINES[system]
    if not content.startswith(magic):
        return [f"it is no library of {system}"]
    if offset is None:
        # The header of Windows' format, whose place is at 60; the processor comes after its four
        # letters.
        offset = struct.unpack_from("<I", content, 60)[0] + 4
    problems = []
    (number,) = struct.unpack_from(form, content, offset)
    if numbers.get(number) != machine:
        problems.append(f"it is for the processor {numbers.get(number, number)}, not {machine}")
    glibc = re.match(r"manylinux_(\d+)_(\d+)_", platform)
    if glibc:
        newest = max(glibc_versions(content), default=(0, 0))
        if newest > (int(glibc[1]), int(glibc[2])):
            problems.append(
                f"it needs glibc {'.'.join(map(str, newest))}, newer than its tag {platform}"
            )
    start = content.find(TABLE_START)
    if start < 0:
        return [*problems, "it has no table of kernels"]
    table = json.loads(content[start : content.index(b"\0", start)])
    names = [law.replace("~", "_along_") for law in table["laws"]]
    # The names of exported functions are text in all three formats; macOS puts an underscore before
    # each, and Windows numbers of two bytes before the first.
    missing = [
        name
        for name in names
        if not re.search(rb"(?<![A-Za-z0-9])" + name.encode() + rb"\0", content)
    ]
    if missing:
        problems.append(f"it lacks {len(missing)} of {len(names)} kernels, such as {missing[0]}")
    return problems


def glibc_versions(content: bytes) -> list[tuple[int, int]]:
    """Return the versions of glibc that a library for Linux asks for."""
    found = re.findall(rb"\0GLIBC_(\d+)\.(\d+)(?:\.\d+)?(?=\0)", content)
    return [(int(major), int(minor)) for major, minor in found]


def main() -> None:
    """Run the command line."""
    source, folder, *platforms = sys.argv[1:]
    failed = False
    for platform in platforms or PLATFORMS:
        wheel = build_wheel(Path(source).resolve(), Path(folder).resolve(), platform)
        problems = check_wheel(wheel)
        size = wheel.stat().st_size / 1e6
        print(f"{wheel.name}: {size:.1f} MB", *problems, sep="\n  ")
        failed = failed or bool(problems)
    sys.exit(failed)


if __name__ == "__main__":
    main()
