"""Tests of the messages about an optional package that is absent or broken."""

import math

import pytest

from osimlite.base.require import require
from osimlite.errors import MissingDependency, OsimliteError


def test_returns_the_module_that_is_there():
    assert require("math", extra="sim", purpose="a sum") is math


def test_returns_the_submodule_not_the_package():
    assert require("xml.dom", extra="sim", purpose="a tree").__name__ == "xml.dom"


def test_names_purpose_package_and_command_of_an_absent_package():
    with pytest.raises(MissingDependency) as caught:
        require("no_such_package.part", extra="plot", purpose="drawing")
    message = str(caught.value)
    assert message.startswith("drawing needs no_such_package, which is not installed")
    assert message.endswith("pip install 'osimlite[plot]'")
    assert isinstance(caught.value, OsimliteError)


@pytest.mark.parametrize(
    ("source", "part"),
    [
        ("import no_such_dependency", "without its dependency no_such_dependency"),
        (
            "raise ImportError('libx.so: wrong ELF class')",
            "cannot be loaded (libx.so: wrong ELF class)",
        ),
    ],
)
def test_tells_a_broken_package_from_an_absent_one(tmp_path, monkeypatch, source, part):
    (tmp_path / "osimlite_broken_example.py").write_text(source)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(MissingDependency, match="osimlite_broken_example") as caught:
        require("osimlite_broken_example", extra="sim", purpose="the engine")
    assert part in str(caught.value)
