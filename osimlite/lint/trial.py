"""File of a finished trial as check target: its measurements, for rules that compare them with limits.

The linter computes without a numeric library: the numbers come from :mod:`osimlite.tools.trials`,
which stands above.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, nan
from typing import ClassVar

from osimlite.base.named_tuples import NamedTuple
from osimlite.io.document.source import Position
from osimlite.lint.checked import CheckTarget
from osimlite.lint.config import Config
from osimlite.lint.diagnostic import Severity
from osimlite.lint.registry import FindingCollector, Threshold

TRIAL = "trial"
"""What rules are about that need such numbers."""

HICKS = "Hicks et al. 2015"
"""Is my model good enough? Best practices for verification and validation of musculoskeletal models
and simulations of movement. J Biomech Eng 137(2), 020905, https://doi.org/10.1115/1.4029304
"""
OPENSIM = "OpenSim's best practices"
"""Simulation with OpenSim - Best Practices, https://opensimconfluence.atlassian.net/wiki/spaces/OpenSim/pages/53087686"""
CHECKLIST = "OpenSim's checklist"
"""For evaluating a simulation, https://simtk-confluence.stanford.edu:8443/plugins/viewsource/viewpagesrc.action?pageId=3376337"""
OSIMLITE = "osimlite"
"""Where nobody has published a limit."""

GOOD = "good"
"""Verdict on a measurement within every limit."""
OKAY = "okay"
"""Verdict on a measurement between the stricter and the looser of two limits."""
BAD = "bad"
"""Verdict on a measurement beyond every limit."""
VERDICTS = (GOOD, OKAY, BAD)
"""The verdicts from best to worst."""

SMALLEST_SHOWN = 0.001
"""What is less is not shown with its digits."""

STATISTICS = {"peak": "the peak of "} | dict.fromkeys(
    ("rms", "rms-translation"), "the root mean square of "
)
"""What stands before the name of what was measured."""


class Measurement(NamedTuple):
    """Measurement of a trial."""

    rule: str  # name of the rule that judges it
    kind: str  # what it is of a column of numbers: one of `KINDS`, or ""
    of: str  # what was measured, in words
    value: float  # in the `unit`
    unit: str  # N, N m, cm, deg, % or ""
    scale: float = nan  # what a limit may be a part of, in the `unit`; NaN if that is not known
    where: str = ""  # at which time, of which marker, in words
    at: Position | None = None  # where that is in the file
    # whether the trial continues with it; else it is worth no more than an info
    is_final: bool = True
    side: str = ""  # what else is known, in words


class TrialVerdict(NamedTuple):
    """Measurement with its limits and the verdict."""

    code: str  # of the rule
    name: str  # of the rule
    of: str  # what was measured, in words
    value: float  # in the `unit`
    unit: str  # N, N m, cm, deg, % or ""
    good: float  # up to which it is good
    bad: float  # from which on it is bad
    verdict: str  # one of `VERDICTS`
    source: str  # of the limits
    where: str  # at which time, of which marker, in words
    file: str  # that it was measured of
    line: int | None  # of the file, counted from 1

    @property
    def shown(self) -> str:
        """The number with its unit."""
        return f"{_format_number(self.value)} {self.unit}".rstrip()

    @property
    def limits(self) -> str:
        """Up to which it is good, and up to which it is okay."""
        return " / ".join(dict.fromkeys((_format_number(self.good), _format_number(self.bad))))

    @property
    def words(self) -> str:
        """The measured quantity and its location."""
        return f"{self.of} ({self.where})" if self.where else self.of


def _format_number(value: float) -> str:
    if 0.0 < value < SMALLEST_SHOWN:
        return f"<{SMALLEST_SHOWN:g}"
    return f"{value:.3g}" if abs(value) < 1000.0 else f"{value:.0f}"


class Trial(CheckTarget):
    """File of a trial under check.

    Args:
        file: its path.
        data: its bytes.
        numbers: that were measured of it.
        config: which rules run.
    """

    about: ClassVar[str] = TRIAL
    file: str

    def __init__(
        self, file: str, data: bytes, numbers: Sequence[Measurement], config: Config | None = None
    ) -> None:
        super().__init__(config)
        self.file, self.data, self.numbers = file, data, numbers
        self.verdicts: list[TrialVerdict] = []

    def judge(
        self,
        report: FindingCollector,
        limits: Sequence[Threshold | float],
        source: str,
        advice: str,
        kind: str = "",
    ) -> None:
        """Compare the measurements of a rule with limits, and record a verdict on each.

        A measurement is good up to the smallest limit, acceptable up to the largest, and bad beyond.
        Acceptable and bad ones are reported as well.

        Args:
            report: the collector of the rule's findings.
            limits: one or two limits, settings or numbers; a setting in % is relative to the scale of
                the measurement. Infinite ones do not count.
            source: publication or document that the limits are from.
            advice: next step, the end of the message.
            kind: compare only measurements of this kind (key of `STATISTICS`).
        """
        (rule,) = report.rules.values()
        for number in self.numbers:
            if number.rule != rule.name or number.kind != kind:
                continue
            limit_values = [
                self.config.value_of(limit)
                # A limit in percent of a number that is not itself in percent is a part of the
                # scale of the measurement.
                * (number.scale / 100.0 if limit.unit == "%" != number.unit else 1.0)
                if isinstance(limit, Threshold)
                else limit
                for limit in limits
            ]
            finite_limits = [limit for limit in limit_values if isfinite(limit)]
            # The scale is NaN where the load or length that a limit refers to was not measured.
            if not finite_limits:
                continue
            good_limit, bad_limit = min(finite_limits), max(finite_limits)
            # NaN is within no limit.
            verdict = (
                GOOD if number.value <= good_limit else OKAY if number.value <= bad_limit else BAD
            )
            self.verdicts.append(
                TrialVerdict(
                    rule.code,
                    rule.name,
                    f"{STATISTICS.get(kind, '')}{number.of}",
                    number.value,
                    number.unit,
                    good_limit,
                    bad_limit,
                    verdict,
                    source,
                    number.where,
                    self.file,
                    number.at.line if number.at is not None else None,
                )
            )
            if verdict != GOOD:
                unit = "" if not number.unit else f" {number.unit}" if number.unit != "%" else " %"
                bad_note = (
                    f", and more than {bad_limit:.3g}{unit} is bad"
                    if bad_limit > good_limit
                    else ""
                )
                report(
                    f"{STATISTICS.get(kind, '')}{number.of} is "
                    f"{_format_number(number.value)}{unit}{f' ({number.where})' if number.where else ''}: "
                    f"up to {good_limit:.3g}{unit} is good{bad_note} ({source}); "
                    f"{f'{number.side}; ' if number.side else ''}{advice}",
                    at=number.at,
                    severity=None if verdict == BAD and number.is_final else Severity.INFO,
                )
