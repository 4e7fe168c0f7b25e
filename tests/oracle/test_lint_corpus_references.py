"""Compare the linter's verdict on broken references of corpus models with OpenSim's.

The quick suite has 40 cases, the full one 120. ``OSIMLITE_BREAKAGES=2000`` sets another number.
"""

from __future__ import annotations

import os
import random
import re
import time
from typing import NamedTuple

import pytest

from osimlite.lint import validate
from tests.oracle.structural_edits import CHANGES
from tests.oracle.support import Victim, victim
from tests.suite import choose

pytestmark = pytest.mark.oracle

WANTED = int(os.environ.get("OSIMLITE_BREAKAGES", choose("40", "120")))
# Time limit (s) of the default number of cases; a larger number gets an hour.
SECONDS = 90 if "OSIMLITE_BREAKAGES" not in os.environ else 3600

# Errors that OpenSim does not mention: it computes something else than the file says.
SILENT = {"OSIM108", "OSIM311", "OSIM322", "OSIM406", "OSIM410", "OSIM414", "OSIM607"}
SILENTLY = ("OpenSim disables the whole probe", "OpenSim welds a hidden body between them")
# OpenSim reads undefined memory in these cases, so that its verdict changes from run to run.
UNDEFINED = ("OpenSim reads beyond the end of the list", "OpenSim reads an undefined number")
# Simbody's messages when all references are valid but the model cannot take its initial pose:
# constraints that contradict each other, or a cable without a way around its obstacles.
ASSEMBLY = ("projectQ", "CableSpan")


class Breakage(NamedTuple):
    """Edited text, and a description of the edit."""

    what: str
    text: str


def broken(model: Victim, draw: random.Random) -> Breakage:
    """Return a model with one broken reference or one broken target.

    Rare kinds of references are chosen as often as common ones.
    """
    if model.targets and draw.random() < 0.25:
        return _without_target(model, draw)
    place = draw.choice(model.places[draw.choice(sorted(model.places))])
    end = place.start + len(place.word)
    if (
        draw.random() < 0.05
        and (around := _element_around(model.text, place.start, end)) is not None
    ):
        text = model.text[: around[0]] + model.text[around[1] :]
        return Breakage(f"{model.name} {place.kind}: '{place.word}' left out with its tag", text)
    new = draw.choice(CHANGES)(draw, place.word, model.names)
    while "<" in new and place.kind.endswith(".name"):
        # A "<" would not be well-formed in an attribute.
        new = draw.choice(CHANGES)(draw, place.word, model.names)
    text = model.text[: place.start] + new + model.text[end:]
    return Breakage(f"{model.name} {place.kind}: '{place.word}' -> '{new}'", text)


def _element_around(text: str, start: int, end: int) -> tuple[int, int] | None:
    """Return the range of the element that contains nothing but the characters from `start` to `end`.

    The result is None if there is no such element.
    """
    before, after = (
        re.search(r"<[^<>/]+>\s*\Z", text[max(0, start - 200) : start]),
        text.find(">", end),
    )
    if before is None or not text[end : after + 1].lstrip().startswith("</"):
        return None
    return start - len(before[0]), after + 1


def _without_target(model: Victim, draw: random.Random) -> Breakage:
    """Remove or rename a component that a reference leads to."""
    target = draw.choice(model.targets[draw.choice(sorted(model.targets))])
    others = sorted({other.name for group in model.targets.values() for other in group})
    same = [other.name for other in model.targets[target.cls]]
    name_end = target.name_start + len(target.name)
    new = draw.choice(
        [
            None,
            f"{target.name}_renamed",
            target.name.swapcase(),
            draw.choice(others),
            draw.choice(same),
            draw.choice(same),
            f"{target.name[:1]}/{target.name[1:]}",
            f"{target.name} ",
            f"{target.name[:1]} {target.name[1:]}",
            f"{target.name}*",
            "",
        ]
    )
    what = f"{model.name} {target.cls} '{target.name}'"
    if new is None:
        return Breakage(f"{what} taken out", model.text[: target.start] + model.text[target.end :])
    return Breakage(
        f"{what} called '{new}'", model.text[: target.name_start] + new + model.text[name_end:]
    )


@pytest.mark.timeout(SECONDS + 300)
def test_the_verdict_on_broken_references_of_real_models_is_that_of_opensim(
    corpus, opensim_says, tmp_path
):
    draw = random.Random(int(os.environ.get("OSIMLITE_SEED", "1")))
    # Surveying a model takes as long as one question to OpenSim, therefore use few models.
    models = draw.sample(corpus, min(len(corpus), WANTED))
    victims = [
        result for model in models if (result := victim(model, tmp_path / model.id)) is not None
    ]
    wrong, refused, asked = [], 0, 0
    end = time.monotonic() + SECONDS
    while asked < WANTED and time.monotonic() < end:
        model = victims[asked % len(victims)]
        what, text = broken(model, draw)
        path = model.folder / "model.osim"
        path.write_text(text, encoding="utf-8")
        message = opensim_says(path)
        asked += 1
        if message is not None and any(words in message for words in ASSEMBLY):
            message = None
        report = validate(path, ignore="OSIM63")
        errors = [
            f for f in report.errors if f.code not in SILENT and not f.message.endswith(SILENTLY)
        ]
        refused += message is not None
        if errors and all(error.message.endswith(UNDEFINED) for error in errors):
            continue
        if bool(errors) != (message is not None):
            ours = "; ".join(map(str, errors[:3])) or "no error"
            wrong.append(
                f"{what}\n  OpenSim: {(message or 'takes it').splitlines()[0][:300]}\n  here: {ours}"
            )
    print(f"{asked} cases, {refused} refused by OpenSim, {len(wrong)} with another verdict")
    assert asked == WANTED or "OSIMLITE_BREAKAGES" not in os.environ
    assert not wrong, f"{len(wrong)} of {asked}:\n" + "\n".join(wrong)
