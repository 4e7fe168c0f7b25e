"""The check of a release's wheels: what is wrong with a library is found and named."""

from __future__ import annotations

import importlib.util
import json
import struct
import zipfile

import pytest

TABLE = json.dumps(
    {"version": "0", "laws": {"evaluate": "1", "merson~16": "2"}}, separators=(",", ":")
).encode()
NAMES = b"\0evaluate\0merson_along_16\0"


@pytest.fixture
def wheels(repo):
    """The script."""
    path = repo / "packaging" / "wheels.py"
    if not path.exists():
        pytest.skip("wheels.py is in the repository only")
    spec = importlib.util.spec_from_file_location("wheels", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def elf(machine=62, rest=b""):
    return b"\x7fELF" + bytes(14) + struct.pack("<H", machine) + NAMES + TABLE + b"\0" + rest


def mach(machine=0x0100000C):
    return (
        b"\xcf\xfa\xed\xfe"
        + struct.pack("<I", machine)
        + b"\0_evaluate\0_merson_along_16\0"
        + TABLE
        + b"\0"
    )


def windows(machine=0x8664):
    return (
        b"MZ"
        + bytes(58)
        + struct.pack("<I", 64)
        + b"PE\0\0"
        + struct.pack("<H", machine)
        + NAMES
        + TABLE
        + b"\0"
    )


def test_good_libraries(wheels):
    assert not wheels.check_library(
        elf(rest=b"\0GLIBC_2.2.5\0GLIBC_2.17\0"), "manylinux_2_17_x86_64"
    )
    assert not wheels.check_library(elf(183), "manylinux_2_17_aarch64")
    assert not wheels.check_library(mach(), "macosx_11_0_arm64")
    assert not wheels.check_library(windows(), "win_amd64")


@pytest.mark.parametrize(
    ("content", "platform", "problem"),
    [
        (
            elf(rest=b"\0GLIBC_2.2.5\0GLIBC_2.29\0"),
            "manylinux_2_17_x86_64",
            "needs glibc 2.29, newer than its tag",
        ),
        (elf(), "manylinux_2_17_aarch64", "for the processor x86_64, not aarch64"),
        (mach(0x01000007), "macosx_11_0_arm64", "for the processor x86_64, not aarch64"),
        (windows(), "manylinux_2_17_x86_64", "no library of linux"),
        (elf().replace(TABLE, b""), "manylinux_2_17_x86_64", "no table of kernels"),
        (
            elf().replace(b"merson_along_16", b"merson"),
            "manylinux_2_17_x86_64",
            "1 kernels are not in it, such as mers",
        ),
    ],
)
def test_what_is_wrong_is_named(wheels, content, platform, problem):
    assert any(problem in text for text in wheels.check_library(content, platform))


def test_a_wheel_has_a_library_for_each_level_of_processors(wheels, tmp_path):
    wheel = tmp_path / "osimlite-0.1.0-py3-none-manylinux_2_17_x86_64.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("osimlite/native/kernels-baseline.so", elf())
    (problem,) = wheels.check_wheel(wheel)
    assert "kernels-x86-64-v3.so" in problem
    with zipfile.ZipFile(wheel, "a") as archive:
        archive.writestr("osimlite/native/kernels-x86-64-v3.so", elf())
    assert not wheels.check_wheel(wheel)
