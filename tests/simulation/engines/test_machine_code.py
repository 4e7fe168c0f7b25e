"""Tests of the selection among sources of machine code, and of the messages about it."""

from __future__ import annotations

from typing import ClassVar

import pytest

from osimlite.errors import OsimliteError
from osimlite.mechanics.codegen.toolchain import CompilationError
from osimlite.simulation.engines import (
    compiled_laws,
    kernel_library,
    linking,
    machine_code,
    numba_laws,
)


class Library:
    """Library that contains only the law `evaluate`."""

    path = "osimlite/native/kernels-baseline.so"
    changed_files: ClassVar[list[str]] = []

    def __init__(self):
        self.table = {"target": "baseline", "compiler": "clang version 14"}

    def get_address(self, name):
        return 100 if name == "evaluate" else None


@pytest.fixture
def sources(monkeypatch):
    """Yield a monkeypatch under which there is no source of machine code, until a test adds one."""
    monkeypatch.delenv(machine_code.VARIABLE, raising=False)
    monkeypatch.setattr(machine_code, "law_addresses", {})
    monkeypatch.setattr(kernel_library, "load_library", lambda: None)
    monkeypatch.setattr(machine_code, "find_compiler", lambda: None)
    monkeypatch.setattr(compiled_laws, "load_law", lambda name: None)
    monkeypatch.setattr(numba_laws, "has_numba", lambda: False)
    linking.warn_of_python.cache_clear()
    yield monkeypatch
    linking.warn_of_python.cache_clear()


def add_library(sources):
    sources.setattr(kernel_library, "load_library", Library)


def add_compiler(sources):
    compiler = type("Compiler", (), {"name": "g++ 12", "version": "12"})()
    sources.setattr(machine_code, "find_compiler", lambda: compiler)
    sources.setattr(compiled_laws, "compile_laws", lambda names: dict.fromkeys(names, 200))


def add_numba(sources):
    sources.setattr(numba_laws, "has_numba", lambda: True)
    sources.setattr(numba_laws, "compile_law", lambda name: 300)


def test_the_library_comes_first_and_the_compiler_has_the_rest(sources):
    for add in (add_library, add_compiler, add_numba):
        add(sources)
    machine_code.prepare_laws(["evaluate", "an_edited_law"])
    assert [machine_code.get_address(name) for name in ("evaluate", "an_edited_law")] == [100, 200]


def test_a_file_of_an_earlier_compilation_comes_before_the_compiler(sources):
    add_compiler(sources)
    sources.setattr(compiled_laws, "load_law", lambda name: 250)
    assert machine_code.get_address("evaluate") == 250


def test_numba_compiles_without_a_compiler(sources):
    add_numba(sources)
    assert machine_code.get_address("evaluate") == 300
    # Numba has no numbers that carry derivatives.
    assert machine_code.can_prepare(["merson"]) and not machine_code.can_prepare(["merson~16"])


def test_numba_compiles_what_the_compiler_refuses(sources):
    def refuse(names):
        raise CompilationError("not translatable")

    add_compiler(sources)
    sources.setattr(compiled_laws, "compile_laws", refuse)
    with pytest.raises(CompilationError, match="not translatable"):
        machine_code.prepare_laws(["evaluate"])
    add_numba(sources)
    assert machine_code.get_address("evaluate") == 300


def test_without_any_source_the_law_is_named(sources):
    with pytest.raises(
        CompilationError, match=r"'merson' is in no library.*neither a C\+\+ compiler nor numba"
    ):
        machine_code.prepare_laws(["merson"])


@pytest.mark.parametrize(
    ("only", "address"), [("library", 100), ("compiler", 200), ("numba", 300), ("python", None)]
)
def test_one_source_can_be_asked_for(sources, only, address):
    for add in (add_library, add_compiler, add_numba):
        add(sources)
    sources.setenv(machine_code.VARIABLE, only)
    assert machine_code.has_machine_code() is (address is not None)
    if address is not None:
        assert machine_code.get_address("evaluate") == address


def test_no_compiler_is_looked_for_where_the_library_has_all(sources):
    """Asking a compiler for its version takes longer than a short simulation."""

    def find():
        raise AssertionError("the compiler was asked for")

    add_library(sources)
    sources.setattr(machine_code, "find_compiler", find)
    assert machine_code.can_prepare(["evaluate"])


def test_an_unknown_source_is_refused(sources):
    sources.setenv(machine_code.VARIABLE, "compilr")
    with pytest.raises(OsimliteError, match=r"OSIMLITE_KERNELS is 'compilr'.*compiler"):
        machine_code.has_machine_code()


@pytest.mark.parametrize(
    ("adds", "words"),
    [
        (
            (add_library, add_compiler),
            ["compiled library", "target baseline", "clang version 14", "g++ 12"],
        ),
        ((add_library,), ["compiled library", "with an edited kernel", "thousand times slower"]),
        (
            (add_compiler,),
            ["without a library", "each kernel is compiled at its first use by g++ 12"],
        ),
        ((add_numba,), ["without a library", "no C++ compiler", "by numba, without derivatives"]),
        ((), ["without a library", "numba is not installed", "thousand times slower"]),
    ],
    ids=["all", "library", "compiler", "numba", "python"],
)
def test_what_runs_is_explained(sources, adds, words):
    for add in adds:
        add(sources)
    text = "\n".join(machine_code.explain_source())
    assert all(word in text for word in words), text


def test_a_library_of_older_sources_is_reported(sources):
    add_library(sources)
    sources.setattr(Library, "changed_files", ["kernels/dynamics.py"])
    assert any(
        "1 source file changed" in line and "pip install -e ." in line
        for line in machine_code.explain_source()
    )


def test_python_takes_over_with_one_warning(sources, caplog):
    for _ in range(2):
        assert linking.select_code() is linking.PYTHON_CODE
    (message,) = caplog.messages
    assert (
        "run as Python, about a thousand times slower" in message
        and "numba is not installed" in message
    )


def test_one_edited_law_without_compiler_has_all_run_as_python(sources, caplog):
    """Machine code calls laws by address, which a law in Python does not have."""
    add_library(sources)
    assert linking.MACHINE_CODE.select_for(["evaluate"]) is linking.MACHINE_CODE
    assert linking.MACHINE_CODE.select_for(["evaluate", "merson"]) is linking.PYTHON_CODE
    assert linking.MACHINE_CODE.select_for(["evaluate"], later=["merson"]) is linking.PYTHON_CODE
    assert "thousand times slower" in caplog.text


def test_derivatives_in_python(sources):
    add_library(sources)
    code = linking.Tangents(4).select_for(["merson"])
    assert isinstance(code, linking.PythonTangents)
