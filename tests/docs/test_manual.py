"""Run every block of code in the manual, page by page, in the order of the page, each page in a new folder.

Python blocks of a page share their names; `sh` blocks are run by bash; TOML, YAML, JSON and XML are
parsed. A comment ``<!-- prepared: commands -->`` creates files that a page assumes; ``<!-- not run:
reason -->`` before a block says why it cannot be run here. After ``<!-- tried: what -->`` comes a
table: the commands and the Python in all but its first column are run.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import NamedTuple

import pytest
from lxml import etree

import osimlite
from osimlite.cli import main

ROOT = Path(__file__).resolve().parents[2]
# The blocks of the gallery are run when the site is built.
PAGES = sorted(
    {path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").rglob("*.md")}
    - {"docs/gallery.md"}
)
QUICK = (
    "adoption", "biorbd", "compiled", "constraints", "errors",
    "format-and-diff", "from-mujoco", "from-urdf", "integrators", "lint-in-ci", "modifying", "plugin-classes", "rules",
    "urdf", "yaml",
)  # fmt: skip
"""Pages whose blocks take at most two seconds.

The quick suite runs these; tests/docs/test_names_used.py reads all pages.
"""
READ_ONLY = ("", "text", "lua", "elisp", "console", "diff", "matlab")
"""Languages of blocks that show output of programs, or that these tests cannot check."""

_BLOCK = re.compile(
    r"(?:<!-- not run: (?P<why>[^>]+) -->\s*)?^(?P<fence>`{3,})(?P<language>\w*)[^\n]*\n(?P<code>.*?)^(?P=fence)"
    r"|<!-- tried: [^>]+ -->\n(?P<table>(?:^\|[^\n]*\n)+)",
    re.M | re.S,
)
_PREPARED = re.compile(r"<!-- prepared: (.*?) -->", re.S)


class Block(NamedTuple):
    """Block of code, or a table with code in it.

    Attributes:
        why: reason why the block is not run; None if it is run.
    """

    language: str
    code: str
    line: int
    why: str | None


def blocks(text: str) -> list[Block]:
    result = []
    for match in _BLOCK.finditer(text):
        part = "code" if match["fence"] else "table"
        line = text.count("\n", 0, match.start(part)) + 1
        result.append(
            Block(match["language"] if match["fence"] else part, match[part], line, match["why"])
        )
    return result


@pytest.fixture
def shell(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return environment variables with which `osimlite` and `python` are those under test."""
    # Share the folder of Matplotlib: with a new one it lists the fonts of the machine, which takes
    # seconds.
    fonts = os.environ.get("MPLCONFIGDIR") or str(tmp_path_factory.getbasetemp() / "matplotlib")
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", "")))
    home = {
        "HOME": str(tmp_path / "home"),
        "XDG_CACHE_HOME": os.environ.get("XDG_CACHE_HOME", str(tmp_path / "cache")),
    }
    return {
        **os.environ,
        "PATH": path,
        "MPLBACKEND": "Agg",
        "MPLCONFIGDIR": fonts,
        "COLUMNS": "100",
        # `prepared` comments use these variables.
        "OSIMLITE_REPOSITORY": str(ROOT),
        **home,
    }


@pytest.mark.skipif(os.name == "nt", reason="blocks of commands are for bash")
@pytest.mark.parametrize(
    "page",
    [
        page
        if page.startswith(tuple(f"docs/{name}" for name in QUICK))
        else pytest.param(page, marks=pytest.mark.full)
        for page in PAGES
    ],
)
def test_every_block_runs(
    page: str, tmp_path: Path, shell: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for package in ("matplotlib",):
        pytest.importorskip(package, reason=f"needs {package} (extra 'all')")
    folder = tmp_path / "work"
    folder.mkdir()
    monkeypatch.chdir(folder)
    names: dict[str, object] = {"__name__": "__manual__"}
    text = (ROOT / page).read_text()
    for commands in _PREPARED.findall(text):
        run(commands, page, shell)
    for block in blocks(text):
        place = f"{page}:{block.line}"
        if block.why is not None:
            continue
        if block.language == "table":
            for words in tried(block.code):
                try_(words, names)
        elif block.language == "python":
            exec(compile("\n" * (block.line - 1) + block.code, str(ROOT / page), "exec"), names)
        elif block.language == "sh":
            run(block.code, place, shell)
        else:
            read(block, place)


def tried(table: str) -> list[str]:
    """Return the distinct code spans in all columns of a table but the first."""
    rows = (row.partition("|")[2].partition("|")[2] for row in table.splitlines())
    return list(dict.fromkeys(words for cells in rows for words in re.findall(r"`([^`]+)`", cells)))


def try_(words: str, names: dict[str, object]) -> None:
    """Run a command in this process, or evaluate Python that begins with a known name; ignore other code spans."""
    first = re.match(r"\w*", words)
    assert first is not None
    if words.startswith("osimlite "):
        with pytest.raises(SystemExit) as ended:
            main(shlex.split(words)[1:])
        assert ended.value.code in (0, None), words
    elif first[0] in names or " = " in words:
        exec(compile(words, words, "exec"), names)


def run(commands: str, place: str, shell: dict[str, str]) -> None:
    """Run commands by bash, and fail if one of them fails."""
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", commands], env=shell, capture_output=True, text=True,
        stdin=subprocess.DEVNULL, check=False,
    )  # fmt: skip
    assert done.returncode == 0, f"{place}\n{commands}\n{done.stdout}\n{done.stderr}"


def read(block: Block, place: str) -> None:
    """Parse a block of TOML, JSON, YAML or XML, and fail if that is not possible."""
    if block.language == "toml":
        tomllib.loads(block.code)
    elif block.language == "json":
        json.loads(block.code)
    elif block.language == "yaml":
        yaml = pytest.importorskip("yaml", reason="needs PyYAML (extra 'yaml')")
        yaml.safe_load(block.code)
    elif block.language == "xml":
        etree.fromstring(f"<all>{block.code}</all>")
    else:
        assert block.language in READ_ONLY, f"{place}: a block of {block.language} that nobody runs"


def test_the_code_of_a_table_is_found_and_fails() -> None:
    text = "<!-- tried: the second column -->\n| a | b |\n|---|---|\n| `no()` | `x = 1`, `x.y` or `--z`; `x = 1` |\n"
    (block,) = blocks(text)
    assert (block.language, block.line) == ("table", 2) and tried(block.code) == [
        "x = 1",
        "x.y",
        "--z",
    ]
    names: dict[str, object] = {}
    try_("x = 1", names)
    try_("--z", names)
    with pytest.raises(AttributeError):
        try_("x.y", names)


def test_a_block_that_is_not_run_is_found() -> None:
    result = blocks(
        "a\n\n<!-- not run: it takes an hour -->\n```sh\nsleep 3600\n```\n\n```python\nx = 1\n```\n"
    )
    assert result == [
        Block("sh", "sleep 3600\n", 5, "it takes an hour"),
        Block("python", "x = 1\n", 9, None),
    ]


def test_the_reference_tells_of_all_that_the_package_exports() -> None:
    pytest.importorskip("numpy", reason="needs numpy (extra 'sim')")
    told = (ROOT / "docs" / "reference" / "library.md").read_text()
    for exported in (getattr(osimlite, name) for name in osimlite.FUNCTIONS):
        name = f"{exported.__module__}.{exported.__name__}"
        assert f"::: {name}\n" in told or f"::: {exported.__module__}\n" in told, name


def test_pages_to_run_unchanged_make_all_their_files_visibly() -> None:
    """A reader does not see comments that create files."""
    for page in PAGES:
        text = " ".join((ROOT / page).read_text(encoding="utf-8").split())
        assert not (
            "run the commands of the tables unchanged" in text and _PREPARED.search(text)
        ), page
