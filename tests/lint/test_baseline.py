"""Check baselines: they count equal findings, and recognise them by message instead of line."""

from __future__ import annotations

from pathlib import Path

import pytest

from osimlite.errors import OsimliteError
from osimlite.lint.baseline import subtract_baseline, write_baseline
from osimlite.lint.diagnostic import Finding, Report, Severity


def finding(code: str = "OSIM303", line: int = 1, message: str = "a message") -> Finding:
    return Finding(code, "a-rule", Severity.WARNING, message, file="a.osim", line=line)


@pytest.fixture
def baseline(tmp_path: Path) -> Path:
    return tmp_path / "known.json"


def test_as_many_findings_as_before_are_known(baseline: Path) -> None:
    assert write_baseline(baseline, Report([finding(line=1), finding(line=2)])) == 2
    for count, new in ((1, 0), (2, 0), (3, 1), (5, 3)):
        report = Report([finding(line=10 * number) for number in range(count)])
        left = subtract_baseline(baseline, report)
        # The additional findings are the last ones.
        assert left.findings == report.findings[count - new :]
        assert left.known == count - new


@pytest.mark.parametrize("other", [finding("OSIM304"), finding(message="another message")])
def test_what_is_not_alike_is_new(baseline: Path, other: Finding) -> None:
    write_baseline(baseline, Report([finding()]))
    left = subtract_baseline(baseline, Report([other, finding()]))
    assert (left.findings, left.known) == ([other], 1)


def test_the_code_of_a_group_knows_its_faults(baseline: Path) -> None:
    """Baselines from before rules became groups have the code of the group for all its faults."""
    write_baseline(baseline, Report([finding("OSIM606"), finding("OSIM606b")]))
    report = Report([finding("OSIM606a"), finding("OSIM606b"), finding("OSIM606c")])
    left = subtract_baseline(baseline, report)
    assert (left.findings, left.known) == (report.findings[2:], 2)


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"findings": [1]}', '{"findings": [["a", "b"]]}']
)
def test_another_file_is_no_baseline(baseline: Path, text: str) -> None:
    baseline.write_text(text)
    with pytest.raises(OsimliteError, match="not a baseline") as caught:
        subtract_baseline(baseline, Report([finding()]))
    assert caught.value.file == str(baseline)
