"""Compare models before and after safe fixes in OpenSim.

After a safe fix OpenSim must read the model that the author meant, or still the one that it read
before.
"""

from __future__ import annotations

import importlib.util
import random
import re
from pathlib import Path

import pytest

from osimlite.io.document.source import Source
from osimlite.lint import validate
from osimlite.lint.fixes import apply_fixes
from tests.oracle.support import victim

pytestmark = pytest.mark.oracle

HERE = Path(__file__).resolve().parents[1]
WALKER = HERE.parent / "fixtures" / "walker" / "DynamicWalkerModel.osim"

_spec = importlib.util.spec_from_file_location("faults", HERE / "lint" / "faults.py")
assert _spec is not None and _spec.loader is not None
faults = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(faults)


def safely_mended(text: str) -> tuple[str, int]:
    """Apply all safe fixes to a text.

    Returns:
        The fixed text, and the number of fixes.
    """
    source = Source(text.encode())
    data, count = apply_fixes(source, validate(source, ignore="OSIM63"))
    return data.decode(), count


def printed(text: str, path: Path) -> str | None:
    """Return OpenSim's print of a document with one spelling of ground, or None if OpenSim rejects it."""
    opensim = pytest.importorskip("opensim")
    opensim.Logger.setLevelString("Off")
    path.write_text(text, encoding="utf-8")
    try:
        model = opensim.Model(str(path))
        model.initSystem()
    except RuntimeError:
        return None
    text = re.sub(r"<!--.*?-->", "", str(model.dump()), flags=re.DOTALL)
    # Relative and absolute paths to ground are the same reference.
    return text.replace(">../../ground<", ">/ground<")


def test_after_a_safe_mend_opensim_reads_what_was_meant(tmp_path):
    original, mends = printed(WALKER.read_text(), tmp_path / "original.osim"), 0
    assert original is not None
    for fault in faults.FAULTS:
        text, count = safely_mended(fault.change(WALKER.read_text())[0])
        if count:
            mends += 1
            assert printed(text, tmp_path / "mended.osim") == original, fault.name
            # A second reading must give the same print: the first one left no changed defaults in
            # the process.
            assert printed(text, tmp_path / "mended.osim") == original, fault.name
    assert mends >= 10


DAMAGE = (
    lambda word: word.lstrip("/"),
    lambda word: word.swapcase(),
    lambda word: word.rpartition("/")[2],
    lambda word: f"{word},",
)


@pytest.mark.full
def test_safe_mends_of_damaged_real_files_give_the_models_back(corpus, tmp_path):
    draw = random.Random(7)
    wrong, mends = [], 0
    for model in corpus:
        result = victim(model, tmp_path / model.id)
        if result is None or len(result.text) > 400_000:
            continue
        path = result.folder / "model.osim"
        original = printed(result.text, path)
        for damage in DAMAGE:
            place = draw.choice(result.places[draw.choice(sorted(result.places))])
            text = (
                result.text[: place.start]
                + damage(place.word)
                + result.text[place.start + len(place.word) :]
            )
            fixed, count = safely_mended(text)
            mends += count
            if count and fixed != result.text and printed(fixed, path) != original:
                wrong.append(f"{model.id} {place.kind}: {place.word} -> {damage(place.word)}")
    assert not wrong, "\n".join(wrong)
    assert mends > 20
