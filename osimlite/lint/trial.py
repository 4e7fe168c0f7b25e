"""File of a finished trial as check target: its measurements, for rules that compare them with limits.

The linter computes without numpy: the measurements come from :mod:`osimlite.tools.trials`, which
imports the linter.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, isnan, nan
from typing import ClassVar

from osimlite.base.named_tuples import NamedTuple
from osimlite.io.document.source import Position
from osimlite.lint.checked import CheckTarget
from osimlite.lint.config import Config
from osimlite.lint.diagnostic import Severity
from osimlite.lint.registry import FindingCollector, Threshold

TRIAL = "trial"
"""Value of `about` of the rules that need such measurements."""

HICKS = "Hicks et al. 2015"
"""Is my model good enough? Best practices for verification and validation of musculoskeletal models
and simulations of movement. J Biomech Eng 137(2), 020905, https://doi.org/10.1115/1.4029304
"""
OPENSIM = "OpenSim's best practices"
"""Simulation with OpenSim - Best Practices, https://opensimconfluence.atlassian.net/wiki/spaces/OpenSim/pages/53087686"""
CHECKLIST = "OpenSim's checklist"
"""For evaluating a simulation, https://simtk-confluence.stanford.edu:8443/plugins/viewsource/viewpagesrc.action?pageId=3376337"""
OSIMLITE = "osimlite"
"""Source of limits that nobody has published."""

GOOD = "good"
"""Verdict on a measurement within every limit."""
OKAY = "okay"
"""Verdict on a measurement between the stricter and the looser of two limits."""
BAD = "bad"
"""Verdict on a measurement beyond every limit."""
VERDICTS = (GOOD, OKAY, BAD)
"""Verdicts from best to worst."""

SMALLEST_PRINTED = 0.001
"""Number below which measurements are shown as less than this number."""

STATISTICS = {"peak": "the peak of "} | dict.fromkeys(
    ("rms", "rms-translation"), "the root mean square of "
)
"""Beginnings of the description of a measurement, by its kind."""


class Measurement(NamedTuple):
    """Measurement of a trial."""

    rule: str  # name of the rule that judges the measurement
    kind: str  # kind that distinguishes measurements of one rule, such as "peak" or "rms"
    of: str  # description of the measured quantity
    value: float  # value in the `unit`
    unit: str  # N, N m, cm, deg, % or ""
    scale: float = nan  # reference of limits in %, in the `unit`; NaN if it is unknown
    where: str = ""  # time or marker of the measurement, in words
    at: Position | None = None  # position of the measurement in the file
    # Whether no later tool improves the result; findings about other results are only remarks.
    is_final: bool = True
    side: str = ""  # further information for the message


class TrialVerdict(NamedTuple):
    """Measurement with its limits and the verdict."""

    code: str  # code of the rule
    name: str  # name of the rule
    of: str  # description of the measured quantity
    value: float  # value in the `unit`
    unit: str  # N, N m, cm, deg, % or ""
    good: float  # largest good value
    bad: float  # largest acceptable value
    verdict: str  # one of `VERDICTS`
    source: str  # source of the limits
    where: str  # time or marker of the measurement, in words
    file: str  # path of the measured file
    line: int | None  # line in the file, from 1

    @property
    def value_text(self) -> str:
        """Value with its unit; "-" without a value."""
        unit = "" if isnan(self.value) else self.unit
        return f"{_format_number(self.value)} {unit}".rstrip()

    @property
    def limits(self) -> str:
        """Largest good and largest acceptable value."""
        return " / ".join(dict.fromkeys((_format_number(self.good), _format_number(self.bad))))

    @property
    def words(self) -> str:
        """Description of the measured quantity, with its time or marker."""
        return f"{self.of} ({self.where})" if self.where else self.of


def _format_number(value: float) -> str:
    """Return a number for the table of results; "-" for NaN, which stands for no value."""
    if isnan(value):
        return "-"
    if 0.0 < value < SMALLEST_PRINTED:
        return f"<{SMALLEST_PRINTED:g}"
    return f"{value:.3g}" if abs(value) < 1000.0 else f"{value:.0f}"


class Trial(CheckTarget):
    """File of a trial under check.

    Args:
        file: path of the file.
        data: content of the file.
        numbers: measurements of the file.
        config: configuration of the check.
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
            report: collector of the findings of the rule.
            limits: one or two limits, settings or numbers; a setting in % is relative to the scale of
                the measurement. Infinite ones do not count.
            source: publication or document that the limits are from.
            advice: next step, the end of the message.
            kind: kind of the measurements to compare, see :class:`Measurement`.
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
            if isnan(number.value):
                report(
                    f"{STATISTICS.get(kind, '')}{number.of} has no value: the results have NaN, "
                    "which stands for times without a solution; run the tool again, and follow its "
                    "messages",
                    at=number.at,
                    severity=None if number.is_final else Severity.INFO,
                )
            elif verdict != GOOD:
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
