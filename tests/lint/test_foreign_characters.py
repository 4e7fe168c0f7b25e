"""Check messages about characters that only look like those of a number."""

from __future__ import annotations

import pytest

from osimlite.io.document.source import Source
from osimlite.lint import validate


@pytest.mark.parametrize(
    ("digits", "named"),
    [
        ("1", "but the text contains U+FF11 (fullwidth digit one)"),
        (
            "121",
            "but the text contains U+FF11 (fullwidth digit one) and U+FF12 (fullwidth digit two)",
        ),
        ("123", "and U+FF13 (fullwidth digit three)"),
        ("12345", "U+FF13 (fullwidth digit three) and 2 more"),
    ],
)
def test_the_first_three_are_named_and_the_others_counted(digits: str, named: str) -> None:
    mass = "".join(chr(ord("\N{FULLWIDTH DIGIT ZERO}") + int(digit)) for digit in digits)
    text = (
        '<OpenSimDocument Version="40600"><Model name="m"><BodySet name="bodyset"><objects>'
        f'<Body name="b"><mass>{mass}</mass></Body></objects></BodySet></Model></OpenSimDocument>'
    )
    found = [str(finding) for finding in validate(Source(text.encode())).findings]
    (about,) = (finding for finding in found if "OSIM201" in finding)
    assert named in about
