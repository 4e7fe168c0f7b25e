"""Tests of the library of kernels that the build creates: its contents, and when it is not used."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from osimlite.mechanics.codegen.toolchain import NATIVE, library_suffix
from osimlite.simulation.elements.laws import DIRECTIONS, list_library_laws
from osimlite.simulation.engines import kernel_library
from osimlite.simulation.engines.kernel_library import KernelLibrary, load_library
from osimlite.simulation.engines.result_cache import CACHE_VARIABLE

LIBRARY = load_library()
needs_library = pytest.mark.skipif(
    LIBRARY is None, reason="osimlite was installed without a library of kernels"
)


@needs_library
def test_every_law_is_in_the_library():
    if LIBRARY.changed_files:
        pytest.skip("needs a library of these sources: 'pip install -e .' compiles it")
    laws = {*list_library_laws(), *list_library_laws(DIRECTIONS)}
    assert {*LIBRARY.table["laws"]} >= laws


@needs_library
def test_the_library_is_that_of_these_sources():
    if LIBRARY.changed_files:
        pytest.skip("the sources have changed since the library was compiled: pip install -e .")
    assert all(LIBRARY.get_address(name) for name in LIBRARY.table["laws"])
    assert LIBRARY.get_address("no_such_law") is None


@pytest.fixture
def library(tmp_path, monkeypatch):
    """Return the library with a copy of the sources from which it was built."""
    package = Path(kernel_library.PACKAGE)
    monkeypatch.setattr(kernel_library, "PACKAGE", tmp_path)
    # Cached results of other folders must not have an effect here.
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "kept"))
    made = KernelLibrary(LIBRARY.path)
    for name in made.table["sources"]:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(package / name, tmp_path / name)
    return made


def edit(library, path):
    """Append a comment to a file, and return the library as the next process loads it."""
    path.write_text(path.read_text("utf-8") + "\n# edited\n", "utf-8")
    return KernelLibrary(library.path)


@needs_library
def test_touched_files_count_as_unchanged(library, tmp_path):
    before = library.changed_files
    os.utime(tmp_path / "mechanics/kernels/dynamics.py", (0, 0))
    assert KernelLibrary(library.path).changed_files == before


@needs_library
def test_an_edited_law_is_not_taken_from_the_library(library, tmp_path, monkeypatch):
    if library.changed_files:
        pytest.skip("the sources have changed since the library was compiled: pip install -e .")
    edited = edit(library, tmp_path / "mechanics/kernels/dynamics.py")
    assert edited.changed_files == ["mechanics/kernels/dynamics.py"]
    # Only a comment was added: all laws are unchanged.
    assert edited.get_address("evaluate") is not None
    monkeypatch.setattr(kernel_library, "compute_digest", lambda function: "of an edited function")
    assert KernelLibrary(library.path).get_address("evaluate") is None


@needs_library
def test_another_translator_concerns_all_laws(library, tmp_path):
    edited = edit(library, tmp_path / "mechanics/codegen/cplusplus/library.py")
    assert edited.get_address("evaluate") is None


@needs_library
def test_the_next_process_computes_no_digest_again(library, tmp_path, monkeypatch):
    edited = edit(library, tmp_path / "mechanics/kernels/dynamics.py")
    address = edited.get_address("evaluate")
    edited.result_cache.save()

    def fail(*_):
        raise AssertionError("computed again")

    monkeypatch.setattr(kernel_library, "compute_digest", fail)
    monkeypatch.setattr(KernelLibrary, "has_changed", fail)
    later = KernelLibrary(library.path)
    assert (later.changed_files, later.get_address("evaluate")) == (edited.changed_files, address)
    # After another edit, the digests are computed again.
    with pytest.raises(AssertionError, match="computed again"):
        assert edit(library, tmp_path / "mechanics/kernels/dynamics.py").changed_files


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Yield an empty folder of libraries."""
    monkeypatch.setattr(kernel_library, "LIBRARY_FOLDER", tmp_path)
    monkeypatch.setattr(kernel_library, "loading_problems", [])
    load_library.cache_clear()
    yield tmp_path
    load_library.cache_clear()


def test_without_a_library(folder):
    assert load_library() is None
    assert kernel_library.explain_absence() == "osimlite was installed without a library of kernels"


def test_a_file_that_is_no_library_is_named(folder):
    name = f"kernels-{NATIVE}{library_suffix()}"
    (folder / name).write_bytes(b"no library")
    assert load_library() is None
    assert f"{name} cannot be loaded" in kernel_library.explain_absence()


@needs_library
def test_a_library_for_another_processor_is_not_used(folder, monkeypatch):
    if LIBRARY.table["target"] != NATIVE:
        pytest.skip("this library runs on any processor of its kind")
    shutil.copy(LIBRARY.path, folder)
    monkeypatch.setattr(kernel_library, "processor_features", lambda: frozenset({"sse2"}))
    assert load_library() is None
    assert "compiled for another processor" in kernel_library.explain_absence()
