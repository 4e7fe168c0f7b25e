"""Tests of damaged MJCF files: a clear error, or a model that can be written and read."""

from __future__ import annotations

import random
import re

import pytest

import osimlite
from osimlite.errors import OsimliteError

pytest.importorskip("mujoco", reason="needs mujoco (extra 'mujoco')")

from tests.suite import choose
from tests.translate.mjcf_import import models

WANTED = choose(5, 10)
"""Number of damaged files in each batch."""
TEXTS = (models.MECHANISM, models.LOOPS, models.SIDES)
NUMBERS = ("0", "-1", "1e300", "-1e-300", "nan", "inf", "", "abc", "1 2 3 4 5 6 7 8", "99999999999")
NUMBER = re.compile(r"(?<=[\" ])-?\d*\.?\d+(?=[\" ])")
ATTRIBUTE = re.compile(r" [a-z0-9]+=\"[^\"]*\"")
ELEMENT = re.compile(r"<[a-z][^<>]*/>")


def damage(text: str, draw: random.Random) -> str:
    """Return the text with one random change."""
    kind = draw.randrange(7)
    if kind == 0:
        return _replace(text, NUMBER, draw, lambda _: draw.choice(NUMBERS))
    if kind == 1:
        return _replace(text, ATTRIBUTE, draw, lambda _: "")
    if kind == 2:
        return _replace(text, ELEMENT, draw, lambda _: "")
    if kind == 3:
        return _replace(text, ELEMENT, draw, lambda found: found * 2)
    if kind == 4 or not text:
        return text[: draw.randrange(len(text) + 1)]
    if kind == 5:
        place = draw.randrange(len(text))
        return text[:place] + chr(draw.randrange(32, 0x250)) + text[place + 1 :]
    # Replace an attribute by that of another element.
    other = draw.choice(ATTRIBUTE.findall(text) or [""])
    return _replace(text, ATTRIBUTE, draw, lambda _: other)


def _replace(text, pattern, draw, make):
    places = list(pattern.finditer(text))
    if not places:
        return text
    found = draw.choice(places)
    return text[: found.start()] + make(found[0]) + text[found.end() :]


@pytest.mark.parametrize("batch", range(50))
def test_a_damaged_file_gives_a_clear_error(batch, tmp_path):
    for number in range(WANTED):
        draw = random.Random(10 * batch + number)
        text = draw.choice(TEXTS)
        for _ in range(draw.randrange(1, 4)):
            text = damage(text, draw)
        path = tmp_path / f"{number}.xml"
        path.write_text(text, encoding="utf-8")
        try:
            made = osimlite.from_mjcf(path, written_for=4, keyframe=None)
        except OsimliteError as error:
            assert "\n" not in str(error) and len(str(error)) > 10
            continue
        assert osimlite.read_text(made.text).name == made.model.name
        made.fidelity.to_json()
