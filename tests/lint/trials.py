"""Read measurements of a trial from the examples and fixtures of rules about trials.

Each line states one number: ``peak of FY: 61 N, with loads of 850 N``.
"""

from __future__ import annotations

import re

from osimlite.io.document.source import Position
from osimlite.lint.config import Config
from osimlite.lint.diagnostic import Report
from osimlite.lint.engine import run_rules
from osimlite.lint.registry import Rule
from osimlite.lint.trial import STATISTICS, Measurement, Trial

LINE = re.compile(
    r"(?P<kind>[a-z-]+)(?P<of> .*): (?P<value>[\d.]+) (?P<unit>[^,]*?)(, with .* of (?P<scale>[\d.]+) .*)?"
)


def trial_in(text: str, rule: Rule, config: Config | None = None) -> Trial:
    """Return a trial with the measurements in a text, all for one rule."""
    numbers = []
    for number, line in enumerate(text.splitlines(), start=1):
        said = LINE.fullmatch(line)
        assert said is not None, line
        of = (
            said["of"].removeprefix(" of ")
            if said["kind"] in STATISTICS
            else said["kind"] + said["of"]
        )
        numbers.append(
            Measurement(
                rule.name, said["kind"], of, float(said["value"]), said["unit"], float(said["scale"] or "nan"),
                at=Position(number, 1),
            )
        )  # fmt: skip
    return Trial("result.sto", text.encode(), numbers, config)


def checked_trial(text: str, rule: Rule, config: Config | None = None) -> Report:
    """Return the findings of the rules in these measurements."""
    return run_rules(trial_in(text, rule, config))
