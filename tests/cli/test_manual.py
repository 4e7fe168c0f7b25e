"""Tests of links from errors to the manual: every error names a page, and every named page exists."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path

import pytest

import osimlite
from osimlite import errors
from osimlite.cli import COMMANDS, main
from osimlite.cli._manual import PAGES, find_page

ROOT = Path(__file__).resolve().parents[2]
toc = pytest.importorskip("markdown.extensions.toc", reason="needs Markdown (extra 'dev')")


def headings(page: str) -> set[str]:
    text = re.sub(r"^```.*?^```", "", (ROOT / page).read_text(encoding="utf-8"), flags=re.M | re.S)
    return {toc.slugify(title, "-") for title in re.findall(r"^#+ (.*)", text, re.M)}


def missing(place: str) -> bool:
    page, _, heading = place.partition("#")
    return not (ROOT / page).is_file() or (heading != "" and heading not in headings(page))


KINDS = [
    kind
    for kind in vars(errors).values()
    if isinstance(kind, type) and issubclass(kind, errors.OsimliteError)
]


def test_the_pages_and_their_headings_are_there():
    places = {*PAGES.values(), *(find_page(kind("of nobody")) for kind in KINDS)}
    assert not [place for place in places if missing(place)] and missing("docs/errors.md#of-nobody")


def test_what_has_a_page_is_there():
    for name in PAGES:
        module, _, last = name.rpartition(".")
        assert hasattr(import_module(module), last) or import_module(name)


def test_whatever_raises_errors_has_a_page():
    assert {f"osimlite.cli.{command.replace('-', '_')}" for command in COMMANDS} <= {*PAGES}
    folder = Path(errors.__file__).parent
    raises = re.compile(rf"raise ({'|'.join(kind.__name__ for kind in KINDS)})\(")
    parts = {
        path.relative_to(folder).parts[0]
        for path in folder.glob("*/**/*.py")
        if raises.search(path.read_text())
    }
    assert "studies" in parts and not parts - {name.split(".")[1] for name in PAGES}


@pytest.mark.parametrize(
    ("words", "page"),
    [
        ("info nobody.osim", "docs/errors.md#files"),
        ("info damaged.osim", "docs/rules.md#text"),
        ("format damaged.osim", "docs/rules.md#text"),
        ("build nobody", "docs/errors.md#models-from-python-yaml-and-json"),
        (
            "build dynamic-walker -p thigh=1 -o x.osim",
            "docs/errors.md#models-from-python-yaml-and-json",
        ),
        ("build dynamic-walker -o damaged.osim/x.osim", "docs/errors.md#files"),
        ("translate walker.osim -o damaged.osim", "docs/errors.md#files"),
        ("rule OSIM999", "docs/rules.md"),
        ("simulate walker.osim --set RHip=1", "docs/simulating.md"),
        ("simulate walker.osim --controls hip=1", "docs/controls.md#set-controls"),
        ("simulate walker.osim --integrator euler", "docs/integrators.md"),
        ("simulate walker.osim --to -1", "docs/simulating.md"),
        ("sweep walker.osim --vary RHip=0:1", "docs/sweeps.md#variables"),
        (
            "sweep walker.osim --vary RHip_rz=0:1 --samples 2 --measure max(",
            "docs/sweeps.md#measures-and-expressions",
        ),
        ("view walker.osim --screenshot x.png --at 1", "docs/viewer.md"),
        ("translate walker.osim --to mjcf --fit all -o x", "docs/mujoco.md"),
    ],
)
def test_the_page_is_that_of_what_failed(words, page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("damaged.osim").write_text("<OpenSimDocument>")
    osimlite.write(import_module("osimlite.models.dynamic_walker").dynamic_walker(), "walker.osim")
    with pytest.raises(SystemExit):
        main(words.split())
    assert capsys.readouterr().err.endswith(f"(see {page})\n")
