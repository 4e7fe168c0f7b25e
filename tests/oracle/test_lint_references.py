"""Compare the linter's verdict on broken references in the walker with OpenSim's."""

from __future__ import annotations

import random
import re
from pathlib import Path

import pytest

from osimlite.io.document.source import Source
from osimlite.lint import validate

pytestmark = pytest.mark.oracle

WALKER = Path(__file__).resolve().parents[2] / "fixtures" / "walker" / "DynamicWalkerModel.osim"
# Elements of the walker whose text names components.
REFERENCE = re.compile(
    r"<(socket_parent_frame|socket_child_frame|socket_parent|socket_frame|coordinate|geometry)>([^<]+)</"
)
# Rules that report broken references.
CODES = ("OSIM301", "OSIM302", "OSIM303", "OSIM304", "OSIM305", "OSIM402", "OSIM409")


def breakages(text: str, count: int, seed: int) -> list[tuple[str, str]]:
    """Return descriptions and texts with one randomly changed reference each.

    Letters are dropped, repeated or change case, or another name or another form of the path is
    written.
    """
    draw = random.Random(seed)
    places = [match for match in REFERENCE.finditer(text) if match[2] != ".."]
    names = sorted(
        {word for match in places for word in match[2].split()}
        | {"RHip_rz", "/jointset/RightShankToThigh"}
    )
    result = []
    for _ in range(count):
        match = draw.choice(places)
        words = match[2].split()
        index = draw.randrange(len(words))
        word = words[index]
        at = draw.randrange(len(word))
        words[index] = draw.choice(
            [
                word[:at] + word[at + 1 :],
                word[:at] + word[at] + word[at:],
                word[:at] + word[at:].swapcase(),
                word.lower(),
                draw.choice(names),
                word.rpartition("/")[2],
                word.lstrip("/"),
                f"/{word}",
                f"{word}/",
                word.replace("/", "//"),
                f"./{word}",
                f"../{word}",
                f"/bodyset/{word}",
                f"/contactgeometryset/{word}",
                "",
            ]
        )
        new = " ".join(words)
        result.append(
            (
                f"{match[1]}: {match[2]} -> {new}",
                text[: match.start(2)] + new + text[match.end(2) :],
            )
        )
    return result


def connects(path: Path) -> bool:
    """Return whether OpenSim resolves all references of the model.

    A loop that OpenSim cannot assemble does not count as a broken reference.
    """
    opensim = pytest.importorskip("opensim")
    opensim.Logger.setLevelString("Off")
    try:
        opensim.Model(str(path)).initSystem()
    except RuntimeError as error:
        return "projectQ" in str(error)
    return True


@pytest.mark.parametrize("seed", range(6))
def test_the_verdict_on_broken_references_is_that_of_opensim(seed, tmp_path):
    text = WALKER.read_text()
    wrong = []
    for what, broken in breakages(text, 15, seed):
        report = validate(Source(broken.encode()))
        if {"OSIM401", "OSIM403", "OSIM404"} & set(report.codes):
            # A joint that leads elsewhere leaves a body without a joint, on which OpenSim crashes.
            continue
        path = tmp_path / "walker.osim"
        path.write_text(broken)
        ours = not set(report.codes) & set(CODES)
        if ours != connects(path):
            wrong.append(f"{what}: OpenSim {'connects' if not ours else 'refuses'}\n{report}")
    assert not wrong, "\n".join(wrong)
