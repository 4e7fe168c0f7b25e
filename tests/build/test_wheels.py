"""Tests of packaging/wheels.py, which checks the wheels of a release and names what is wrong with a library."""

from __future__ import annotations

import importlib.util
import json
import struct
import sys
import zipfile

import pytest

from osimlite.mechanics.codegen import toolchain

TABLE = json.dumps(
    {"version": "0", "laws": {"evaluate": "1", "merson~16": "2"}}, separators=(",", ":")
).encode()
NAMES = b"\0evaluate\0merson_along_16\0"


@pytest.fixture
def wheels(repo):
    """Import packaging/wheels.py as a module."""
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
            "it lacks 1 of 2 kernels, such as mers",
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


def test_the_first_name_of_windows_comes_after_its_numbers(wheels):
    library = windows().replace(b"\0evaluate", b"\x4e\x01evaluate")
    assert not wheels.check_library(library, "win_amd64")


SMALL = """extern "C" EXPORT long long evaluate() { return 1; }
extern "C" EXPORT long long merson_along_16() { return 2; }
extern "C" EXPORT const char osimlite_kernel_table[] = {%s, 0};
"""
PLATFORMS = (
    "manylinux_2_17_x86_64 manylinux_2_17_aarch64 macosx_11_0_arm64 macosx_11_0_x86_64 win_amd64"
)


@pytest.mark.full
@pytest.mark.parametrize("platform", PLATFORMS.split())
def test_a_library_is_linked_for_every_platform(repo, wheels, platform, tmp_path, monkeypatch):
    pytest.importorskip("ziglang", reason="needs ziglang: pip install ziglang")
    assert [*wheels.PLATFORMS] == PLATFORMS.split()
    zig = f"{sys.executable} -m ziglang c++ -target {wheels.PLATFORMS[platform]}"
    monkeypatch.setenv("CXX", zig)
    toolchain.find_compiler.cache_clear()
    try:
        compiler = toolchain.find_cross_compiler(platform)
    finally:
        toolchain.find_compiler.cache_clear()
    export = (
        "__declspec(dllexport)"
        if compiler.system == "win32"
        else '__attribute__((visibility("default")))'
    )
    text = f"#define EXPORT {export}\n" + SMALL % ",".join(map(str, TABLE))
    (tmp_path / "small.cpp").write_text(text)
    built = []
    for target in compiler.targets:
        compiler.compile(tmp_path / "small.cpp", tmp_path / "small.o", target)
        library = tmp_path / f"small{toolchain.library_suffix(compiler.system)}"
        for _ in range(2):
            compiler.link([tmp_path / "small.o"], library)
            built.append(library.read_bytes())
        assert built[-1] == built[-2], "two builds differ"
        assert not wheels.check_library(built[-1], platform)
