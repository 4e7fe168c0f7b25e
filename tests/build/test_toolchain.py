"""Tests of the search for a C++ compiler and of the options that it gets."""

from __future__ import annotations

import sys

import pytest

from osimlite.mechanics.codegen import toolchain
from osimlite.mechanics.codegen.processor import X86_64_V3 as V3_FEATURES
from osimlite.mechanics.codegen.processor import read_cpuinfo
from osimlite.mechanics.codegen.toolchain import (
    BASELINE,
    NATIVE,
    X86_64_V3,
    CompilationError,
    Compiler,
    find_compiler,
    find_cross_compiler,
)

GCC = Compiler(("g++",), "g++ 12", is_gcc=True, system="linux", machine="x86_64")
CLANG = Compiler(("clang++",), "clang version 14", is_gcc=False, system="linux", machine="x86_64")


@pytest.fixture
def programs(tmp_path, monkeypatch):
    """Yield a function that adds a fake compiler to a search path without other programs."""
    if sys.platform == "win32":
        pytest.skip("the programs are scripts of a shell")
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CXX", raising=False)
    monkeypatch.setattr(toolchain, "has_developer_tools", lambda: True)
    find_compiler.cache_clear()

    def add(name, version, code=0):
        path = tmp_path / name
        path.write_text(f"#!/bin/sh\necho '{version}'\nexit {code}\n")
        path.chmod(0o755)
        return str(path)

    yield add
    find_compiler.cache_clear()


def test_without_a_compiler(programs):
    assert find_compiler() is None


def test_clang_comes_before_gcc(programs):
    programs("g++", "g++ (Debian) 12.2.0")
    path = programs("clang++", "Debian clang version 14.0.6")
    assert find_compiler() == Compiler((path,), "Debian clang version 14.0.6", is_gcc=False)


def test_a_compiler_that_does_not_run_is_passed_over(programs):
    programs("clang++", "clang version 14", code=1)
    path = programs("g++", "g++ (Debian) 12.2.0")
    found = find_compiler()
    assert found.command == (path,) and found.is_gcc


def test_the_variable_names_a_compiler_with_its_options(programs, monkeypatch):
    programs("clang++", "clang version 14")
    path = programs("zig", "clang version 22.1.8")
    monkeypatch.setenv("CXX", f"{path} c++ -target x86_64-linux-gnu.2.17")
    assert find_compiler().command == (path, "c++", "-target", "x86_64-linux-gnu.2.17")
    for platform, system, machine in (
        ("manylinux_2_17_aarch64", "linux", "aarch64"),
        ("macosx_11_0_arm64", "darwin", "aarch64"),
        ("macosx_11_0_x86_64", "darwin", "x86_64"),
        ("win_amd64", "win32", "x86_64"),
    ):
        compiler = find_cross_compiler(platform)
        assert (compiler.system, compiler.machine) == (system, machine)


def test_results_are_those_of_python_whatever_the_target():
    for compiler in (GCC, CLANG):
        for target in (BASELINE, X86_64_V3, NATIVE):
            flags = compiler.flags(target)
            assert {"-ffp-contract=off", "-fno-fast-math", "-std=c++17"} <= {*flags}


def test_targets():
    assert GCC.targets == (X86_64_V3, BASELINE)
    assert GCC._replace(machine="aarch64").targets == (BASELINE,)
    assert "-march=native" in GCC.flags(NATIVE) and "-march=x86-64-v3" in CLANG.flags(X86_64_V3)
    assert not any(flag.startswith("-march") for flag in GCC.flags(BASELINE))
    assert "-mcpu=native" in GCC._replace(machine="aarch64").flags(NATIVE)
    # Only g++ selects the vector width by the processor, on x86 but not on aarch64.
    assert "-mprefer-vector-width=256" in GCC.flags(NATIVE)
    assert "-mprefer-vector-width=256" not in CLANG.flags(NATIVE)
    assert "-mprefer-vector-width=256" not in GCC._replace(machine="aarch64").flags(NATIVE)
    # The default inlining limits are too low for kernels; g++ and clang have different options for
    # them.
    assert any(flag.startswith("--param") for flag in GCC.flags(NATIVE))
    assert not any(flag.startswith("--param") for flag in CLANG.flags(NATIVE))
    assert "-inline-threshold=500" in CLANG.flags(
        NATIVE
    ) and "-inline-threshold=500" not in GCC.flags(NATIVE)


def test_an_error_of_the_compiler_is_one_sentence(programs, tmp_path):
    path = programs("g++", "one\nlaw.cpp:3: error: what is this", code=1)
    compiler = Compiler((path,), "g++ 12", is_gcc=True)
    with pytest.raises(CompilationError, match="ended with 1"):
        compiler.compile(tmp_path / "law.cpp", tmp_path / "law.o")


def test_features_of_a_processor(tmp_path):
    file = tmp_path / "cpuinfo"
    file.write_text("processor\t: 0\nflags\t\t: fpu sse2 avx2\nbugs\t\t: none\n")
    assert read_cpuinfo(str(file)) == {"fpu", "sse2", "avx2"}
    file.write_text("processor\t: 0\nFeatures\t: fp asimd\n")
    assert read_cpuinfo(str(file)) == {"fp", "asimd"}
    assert read_cpuinfo(str(tmp_path / "none")) == frozenset()
    assert "avx2" in V3_FEATURES
