"""Tests of damaged trials and setups: results, or a clear error that names a file, but no traceback or partial file.

``OSIMLITE_DAMAGES=500 pytest tests/tools/test_damaged.py`` tries more of them.
"""

from __future__ import annotations

import os
import random
import re
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.errors import OsimliteError
from tests.tools.support import laid_out, state

COUNT = int(os.environ.get("OSIMLITE_DAMAGES", "30"))

SETUPS = "z_ik.xml", "id.xml", "analyze.xml", "forward.xml", "scale.xml"
WORDS = (
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e-320",
    "0",
    "-1",
    "abc",
    "",
    "1e999",
    "0.1.2",
    "1,5",
    "²",
    "0x10",
)
LOST = (
    "no.xml",
    "../",
    "/",
    "trial.trc",
    "a b.mot",
    "nowhere/deep/er",
    "model.osim",
    "\x01",
    "ü.mot",
    ".",
    "id.xml",
)


def number(text: str, random: random.Random) -> str:
    """Replace one number by another word."""
    result = list(re.finditer(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e-?\d+)?(?![\w.])", text))
    if not result:
        return text
    one = random.choice(result)
    return text[: one.start()] + random.choice(WORDS) + text[one.end() :]


def line_gone(text: str, random: random.Random) -> str:
    lines = text.splitlines(keepends=True)
    del lines[random.randrange(len(lines))]
    return "".join(lines)


def line_twice(text: str, random: random.Random) -> str:
    lines = text.splitlines(keepends=True)
    place = random.randrange(len(lines))
    return "".join([*lines[: place + 1], *lines[place:]])


def lines_shuffled(text: str, random: random.Random) -> str:
    lines = text.splitlines(keepends=True)
    one, two = random.randrange(len(lines)), random.randrange(len(lines))
    lines[one], lines[two] = lines[two], lines[one]
    return "".join(lines)


def cut(text: str, random: random.Random) -> str:
    return text[: random.randrange(len(text))]


def letter(text: str, random: random.Random) -> str:
    place = random.randrange(len(text))
    return text[:place] + random.choice("xZ<>&\t\n 0-é\x00") + text[place + 1 :]


def cell_gone(text: str, random: random.Random) -> str:
    cells = re.split(r"(\t)", text)
    place = random.randrange(0, len(cells), 2)
    cells[place] = random.choice(("", "  ", "NaN"))
    return "".join(cells)


def columns_gone(text: str, random: random.Random) -> str:
    """Remove a marker or coordinate for some rows."""
    lines = text.splitlines()
    column, first = random.randrange(1, 12), random.randrange(len(lines))
    for index in range(first, min(len(lines), first + random.choice((1, 5, 1000)))):
        cells = lines[index].split("\t")
        if len(cells) > column + 3:
            cells[column : column + 3] = ["", "", ""]
            lines[index] = "\t".join(cells)
    return "\n".join(lines) + "\n"


def units(text: str, random: random.Random) -> str:
    return text.replace("\tm\t", random.choice(("\tmm\t", "\tcm\t", "\tfurlong\t", "\t\t")))


def line_ends(text: str, random: random.Random) -> str:
    old, new = random.choice((("", "\ufeff"), ("\n", "\r\n"), ("\t", "  "), ("\n", "\r")))
    return text.replace(old, new) if old else new + text


def every_second(text: str, random: random.Random) -> str:
    """Leave out frames, so that the rate differs from that in the header."""
    lines = text.splitlines(keepends=True)
    return "".join(lines[:8] + lines[8 :: random.choice((2, 7, 30))])


def name_lost(text: str, random: random.Random) -> str:
    """Change the name of a file, a marker or a body."""
    result = list(re.finditer(r">([^<>\s][^<>\n]*)<", text))
    if not result:
        return text
    one = random.choice(result)
    return (
        text[: one.start(1)] + random.choice((*LOST, one[1] + "x", one[1][1:])) + text[one.end(1) :]
    )


def tag_lost(text: str, random: random.Random) -> str:
    result = list(re.finditer(r"<(/?\w+)", text))
    if not result:
        return text
    one = random.choice(result)
    return text[: one.start(1)] + one[1] + random.choice("xs1") + text[one.end(1) :]


DAMAGES: tuple[Callable[[str, random.Random], str], ...] = (
    number, number, number, line_gone, line_twice, lines_shuffled, cut, letter, cell_gone, columns_gone, units,
    line_ends, every_second, name_lost, name_lost, tag_lost,
)  # fmt: skip


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Return the contents of all files of an undamaged trial, by path."""
    folder = tmp_path_factory.mktemp("whole")
    laid_out(folder)
    return state(folder)


@pytest.mark.parametrize("seed", range(COUNT))
def test_a_clear_error_or_an_answer(seed: int, whole: dict[str, bytes], tmp_path: Path) -> None:
    chance = random.Random(seed)
    for name, content in whole.items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content)
    trial, setup = tmp_path / "trial", chance.choice(SETUPS)
    data = {
        "z_ik.xml": "trial.trc",
        "scale.xml": "trial.trc",
        "forward.xml": "states.sto",
        "id.xml": "ik.mot",
    }
    target = trial / chance.choice(
        (setup, data.get(setup, "motion.mot"), data.get(setup, "motion.mot"))
    )
    text = target.read_text()
    told = []
    for _ in range(chance.choice((1, 1, 2, 3))):
        damage = chance.choice(DAMAGES)
        told.append(damage.__name__)
        text = damage(text, chance) or text
    target.write_bytes(
        text.encode("utf-8", "surrogateescape" if chance.random() < 0.9 else "replace")
    )
    before = state(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        try:
            outcome = osimlite.run(trial / setup, check=chance.random() < 0.5)
        except OsimliteError as error:
            assert str(error) and len(str(error)) < 1500, told
            assert state(tmp_path) == before, f"{told} of {target.name}: {error}"
            return
    for name, table in outcome.tables.items():
        assert table.times.shape == (len(table.rows),) and np.isfinite(table.times).all(), (
            told,
            name,
        )
        if "marker" not in name:
            assert np.isfinite(table.rows).all(), (
                f"{told} of {target.name} gave no numbers in {name}"
            )
