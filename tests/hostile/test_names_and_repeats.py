"""Check names that would break a table, and elements that are repeated."""

from __future__ import annotations

import re
import time
from pathlib import Path

import pytest

from osimlite.io.document.source import Source
from osimlite.lint import validate
from tests.cli.command import run
from tests.lint.verdict_cases import small_model

SPRING = '<SpringGeneralizedForce name="f"><coordinate>q</coordinate><stiffness>2</stiffness></SpringGeneralizedForce>'
SEPARATORS = {"tab": "&#9;", "line feed": "&#10;", "carriage return": "&#13;", "U+2028": "&#8232;"}
SEPARATORS["header"] = "&#10;endheader&#10;"
NAMED = {"force": 'name="f"', "joint": 'name="j"'}


@pytest.mark.parametrize("separator", SEPARATORS)
@pytest.mark.parametrize("named", NAMED)
def test_no_table_is_written_with_a_name_that_breaks_it(
    named: str, separator: str, tmp_path: Path
) -> None:
    old = NAMED[named]
    text = small_model(forces=SPRING).replace(old, f'{old[:-1]}{SEPARATORS[separator]}x"')
    (tmp_path / "m.osim").write_text(text, encoding="utf-8")
    done = run("simulate", str(tmp_path / "m.osim"), "--to", "0.01", "-o", str(tmp_path / "out"))
    assert done.code == 2 and "holds a tab or a line end" in done.err
    assert not [*(tmp_path / "out").glob("*.sto")]


@pytest.mark.parametrize("name", ["BodySet", "JointSet", "ForceSet", "ContactGeometrySet"])
def test_elements_that_stand_many_times_are_checked_in_linear_time(
    name: str, fixtures: Path
) -> None:
    text = (fixtures / "walker" / "DynamicWalkerModel.osim").read_text(encoding="utf-8")
    pattern = re.compile(
        rf"(<{name}\b[^>]*>\s*<objects>)(.*?)(</objects>\s*(?:<groups />\s*)?</{name}>)", re.DOTALL
    )
    times = []
    for count in (20, 40):
        match = pattern.search(text)
        assert match is not None
        copies = text[: match.end(1)] + match[2] * count + text[match.start(3) :]
        begin = time.process_time()
        assert validate(Source(copies.encode(), "m.osim"), ignore="OSIM63").errors
        times.append(time.process_time() - begin)
    assert times[1] < 4.0 * times[0] + 1.0
