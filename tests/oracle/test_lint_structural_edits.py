"""Compare the linter's verdict on randomly edited corpus models with OpenSim's.

Models that OpenSim rejects must have an error, and no error may claim a rejection that does not
happen. The models are tested as published, in all versions of the format, and as OpenSim prints
them. The quick suite has 20 edits, the full one 100. ``OSIMLITE_EDITS=2000 OSIMLITE_SEED=7`` sets
their number and the seed.
"""

from __future__ import annotations

import gzip
import os
import random
import shutil
import time
from collections import Counter
from pathlib import Path

import pytest

from osimlite.lint import Finding, Report, validate
from tests.conftest import CorpusModel
from tests.oracle.structural_edits import Text, edits
from tests.oracle.support import claims_refusal
from tests.suite import choose

pytestmark = pytest.mark.oracle

WANTED = int(os.environ.get("OSIMLITE_EDITS", choose("20", "100")))
# Time limit (s) and size limit (bytes) of the default number of edits. A larger number gets two
# hours, and includes the large models.
SECONDS = 60 if "OSIMLITE_EDITS" not in os.environ else 7200
LARGEST = 150_000 if "OSIMLITE_EDITS" not in os.environ else 10_000_000


def new_errors(report: Report, before: Counter[tuple[str, str]]) -> list[Finding]:
    """Return the errors of an edited model that the original model does not have."""
    left, result = before.copy(), []
    for finding in report.errors:
        if left[finding.code, finding.message] > 0:
            left[finding.code, finding.message] -= 1
        else:
            result.append(finding)
    return result


def victims(models: list[CorpusModel], folder: Path) -> list[Path]:
    """Write each model as published and as OpenSim prints it, with the files that it needs.

    Each version has a folder of its own; the result lists the model files.
    """
    result = []
    for model in models:
        texts = [model.path.read_bytes()]
        if model.converted is not None:
            texts.append(gzip.decompress(model.converted.read_bytes()))
        for number, text in enumerate(texts):
            if len(text) > LARGEST or b"<Model" not in text:
                continue
            result.append(folder / f"{model.id}-{number}" / "model.osim")
            result[-1].parent.mkdir()
            for other in model.path.parent.iterdir():
                if other.is_file() and other != model.path:
                    shutil.copy(other, result[-1].parent / other.name)
            result[-1].write_bytes(text)
    return result


@pytest.mark.timeout(SECONDS + 300)
def test_the_verdict_on_edited_models_is_that_of_opensim(corpus, opensim_says, tmp_path):
    taken = [path for path in victims(corpus, tmp_path) if opensim_says(path) is None]
    texts = [Text(path.read_bytes().decode("utf-8", "replace")) for path in taken]
    before = [
        Counter((f.code, f.message) for f in validate(path, ignore="OSIM63").errors)
        for path in taken
    ]
    draw = random.Random(int(os.environ.get("OSIMLITE_SEED", "1")))
    counts: Counter[str] = Counter()
    wrong = []
    end = time.monotonic() + SECONDS
    while counts["edits"] < WANTED and time.monotonic() < end:
        number = draw.randrange(len(taken))
        edit = next(edits(texts[number], draw))
        path = taken[number].with_name("edited.osim")
        path.write_text(edit.text, encoding="utf-8")
        message = opensim_says(path)
        if message is not None and "killed by signal 14" in message:
            # OpenSim neither accepted nor rejected the model: it was stopped by the time limit.
            continue
        counts["edits"] += 1
        counts["refused"] += message is not None
        errors = new_errors(validate(path, ignore="OSIM63"), before[number])
        claims = [finding for finding in errors if claims_refusal(finding)]
        if message is not None and not errors:
            counts["missed"] += 1
            wrong.append(
                f"{taken[number].parent.name} {edit.what}\n  OpenSim: {' '.join(message.split())[:300]}\n  no error"
            )
        elif message is None and claims:
            counts["claimed wrongly"] += 1
            wrong.append(
                f"{taken[number].parent.name} {edit.what}\n  OpenSim takes it\n  {claims[0]}"
            )
    print(dict(counts))
    assert counts["edits"] == WANTED or "OSIMLITE_EDITS" not in os.environ
    assert not wrong, f"{counts}:\n" + "\n".join(wrong)
