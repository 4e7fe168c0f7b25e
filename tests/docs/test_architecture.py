"""Tests of the pages on the architecture: their files and classes exist, and the diagram shows the current imports."""

from __future__ import annotations

import ast
import builtins
import re
from functools import cache
from pathlib import Path

import pytest

import osimlite
from osimlite import errors

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
PATH = re.compile(
    r"`((?:osimlite|docs|tests|packaging|schemas|fixtures|benchmarks|editors)/[\w/.-]*)`"
)


def read_text(name: str) -> str:
    """Return the text of a file of the repository."""
    return (ROOT / name).read_text(encoding="utf-8")


def list_rooms() -> set[str]:
    """Return the names of the packages at the top level of osimlite."""
    return {path.parent.name for path in (ROOT / "osimlite").glob("*/__init__.py")}


@pytest.mark.parametrize("page", ["docs/architecture.md", "CONTRIBUTING.md", "README.md"])
def test_every_path_of_a_page_exists(page: str) -> None:
    # A guide writes NAME and CODE as placeholders.
    paths = [path for path in PATH.findall(read_text(page)) if not re.search("NAME|CODE", path)]
    assert paths
    assert not [path for path in paths if not (ROOT / path).exists()]


def test_the_tables_of_forms_name_classes_of_these_files() -> None:
    rows = re.findall(r"^\| [^|]+ \| `(\w+)` \| `([\w/]+\.py)` \|", PAGE, re.M)
    assert len(rows) > 10
    for name, path in rows:
        tree = ast.parse(read_text(path))
        assert name in {node.name for node in tree.body if isinstance(node, ast.ClassDef)}, (
            f"{path} has no class {name}"
        )


@pytest.mark.parametrize("page", ["docs/architecture.md", "CONTRIBUTING.md"])
def test_classes_of_a_section_are_defined_beside_the_files_that_it_names(page: str) -> None:
    """Search only files that the section names: a class of the same name elsewhere must not hide an outdated page."""
    missing = []
    on_page = [ROOT / path for path in PATH.findall(read_text(page)) if path.endswith(".py")]
    known = {*dir(builtins), *dir(osimlite), *dir(errors)}.union(*map(list_definitions, on_page))
    for section in re.split(r"^##+ ", read_text(page), flags=re.M):
        named = [ROOT / path for path in PATH.findall(section)]
        folders = {path if path.is_dir() else path.parent for path in named if path.exists()}
        files = [file for folder in folders for file in folder.rglob("*.py")]
        defined = known.union(*map(list_definitions, files))
        for name in re.findall(r"`([A-Z]\w*[a-z]\w*)(?:\.\w+)?(?:\([^`]*\))?`", section):
            if name not in defined:
                missing.append((section.partition("\n")[0], name))
    assert not missing


@cache
def list_definitions(path: Path) -> set[str]:
    """Return the names of the classes and of the types in variables of a module."""
    # Regular expressions suffice here; parsing all files of the package would take seconds.
    return {*re.findall(r"^(?:class )?(\w+)(?: =|[:(])", path.read_text(encoding="utf-8"), re.M)}


def test_the_table_of_rooms_is_complete() -> None:
    assert set(re.findall(r"^\| `osimlite/(\w+)/` \|", PAGE, re.M)) == list_rooms()


def test_the_readme_has_a_line_for_every_room() -> None:
    listed = read_text("README.md").split("## Where things are", 1)[1]
    assert set(re.findall(r"^osimlite/(\w+)/ ", listed, re.M)) == list_rooms()


def test_the_picture_is_current() -> None:
    pytest.importorskip("grimp", reason="needs import-linter (extra 'dev')")
    from docs import _architecture as architecture

    picture = architecture.PICTURE.read_text(encoding="utf-8")
    assert picture == architecture.make_picture(), "run: python packaging/regenerate.py"


def test_arrows_that_follow_from_others_are_left_out() -> None:
    grimp = pytest.importorskip("grimp", reason="needs import-linter (extra 'dev')")
    from docs import _architecture as architecture

    graph = grimp.ImportGraph()
    for importer, imported in (("a", "b"), ("b", "c"), ("a", "c")):
        graph.add_import(importer=f"osimlite.{importer}.x", imported=f"osimlite.{imported}.x")
    assert architecture.find_arrows(graph, ["a", "b", "c"]) == {("a", "b"), ("b", "c")}
