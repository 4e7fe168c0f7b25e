"""Tests of packaging/kernel_library.py, which builds the library of kernels and decides when to build it again."""

from __future__ import annotations

import importlib.util
import shutil

import pytest


@pytest.fixture
def script(repo):
    """Import packaging/kernel_library.py as a module."""
    path = repo / "packaging" / "kernel_library.py"
    if not path.exists():
        pytest.skip("packaging/kernel_library.py is not here: this is not a source tree")
    spec = importlib.util.spec_from_file_location("build_kernel_library", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_other_options_of_the_compiler_are_another_recipe(script, tmp_path, monkeypatch):
    before = script.recipe()
    copy = tmp_path / "toolchain.py"
    shutil.copy(script.toolchain.__file__, copy)
    monkeypatch.setattr(script.toolchain, "__file__", str(copy))
    assert script.recipe() == before
    copy.write_text(copy.read_text("utf-8").replace("-fno-math-errno", "-fmath-errno"), "utf-8")
    assert script.recipe() != before
