"""Configuration of a check: which rules run, with which severities and thresholds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from osimlite.base.records import dataclass, field
from osimlite.errors import OsimliteError
from osimlite.lint.diagnostic import Severity

if TYPE_CHECKING:
    from osimlite.lint.registry import Rule, Threshold


@dataclass(frozen=True, slots=True)
class Config:
    """Selection of rules, their severities, and their thresholds.

    `select` and `ignore` hold codes (``OSIM301``), the beginning of codes (``OSIM3``) or names of
    rules (``unresolved-reference``); an empty `select` means all. `severity` overrides that of a
    rule. `mesh_paths` are folders where meshes are looked for besides OpenSim's own places.
    `thresholds` are numbers by the names that ``osimlite rule CODE`` shows. `classes` are files
    that declare the classes of plug-ins, `target_version` the release of OpenSim that is to read
    the files, 4.6 if it is empty.
    """

    select: tuple[str, ...] = ()
    ignore: tuple[str, ...] = ()
    severity: Mapping[str, Severity] = field(default_factory=dict)
    mesh_paths: tuple[str, ...] = ()
    thresholds: Mapping[str, float] = field(default_factory=dict)
    classes: tuple[str, ...] = ()
    target_version: str = ""

    def __post_init__(self) -> None:
        """Check the thresholds and the version; OsimliteError if one makes no sense."""
        if self.target_version:
            from osimlite.lint.history import load_later_changes

            load_later_changes(self.target_version)
        if self.thresholds:
            _check_thresholds(self.thresholds)

    def includes(self, rule: Rule) -> bool:
        """Return whether a rule runs."""
        # The usual case, for each of several hundred rules.
        if not self.select and not self.ignore:
            return True
        selected = not self.select or any(rule.matches(word) for word in self.select)
        return selected and not any(rule.matches(word) for word in self.ignore)

    def severity_of(self, rule: Rule, default: Severity) -> Severity:
        """Return the severity of a finding, given the severity `default` of its rule.

        Args:
            rule: rule of the finding.
            default: severity of the finding without settings.
        """
        # The first setting that matches decides, in the order of the configuration file.
        for selector, severity in self.severity.items():
            if rule.matches(selector):
                return severity
        return default

    def value_of(self, threshold: Threshold) -> float:
        """Return the value of a threshold."""
        return (
            self.thresholds.get(threshold.name, threshold.default)
            if self.thresholds
            else threshold.default
        )


def _check_thresholds(thresholds: Mapping[str, float]) -> None:
    """Raise an error for an unknown threshold, or for a value that is not a number of 0 or more.

    Raises:
        OsimliteError: no rule has the threshold, or its value is not a number of 0 or more.
    """
    from osimlite.base.text import append_clause, suggest_name
    from osimlite.lint.registry import all_rules

    names = [threshold.name for rule in all_rules() for threshold in rule.thresholds]
    for name, number in thresholds.items():
        if name not in names:
            raise OsimliteError(
                append_clause(
                    f"no rule has a threshold '{name}'{suggest_name(name, names)}",
                    "`osimlite rule CODE` shows the thresholds of a rule",
                )
            )
        if (
            # `bool` is a subclass of `int` in Python.
            isinstance(number, bool)
            or not isinstance(number, int | float)
            or not 0 <= number < math.inf
        ):
            raise OsimliteError(
                f"the threshold '{name}' must be a number, 0 or more, not '{number}'"
            )


def parse_codes(words: tuple[str, ...] | list[str] | str | None) -> tuple[str, ...]:
    """Parse codes or names of rules; a text may contain several, separated by commas.

    Returns:
        The codes and names.

    Raises:
        OsimliteError: no rule has one of the codes or names.
    """
    separate_words = (
        words.split(",")
        if isinstance(words, str)
        else [part for word in words or () for part in word.split(",")]
    )
    cleaned = tuple(word.strip() for word in separate_words if word.strip())
    if not cleaned:
        return ()
    # A check without options need not import all rules.
    from osimlite.lint.registry import all_rules, rule_groups

    for word in cleaned:
        if not any(rule.matches(word) for rule in all_rules()):
            from osimlite.base.text import suggest_name

            known_words = [
                name for rule in (*all_rules(), *rule_groups()) for name in (rule.code, rule.name)
            ]
            hint = suggest_name(word, known_words) or "; 'osimlite rule' lists all rules"
            raise OsimliteError(f"no rule has the code or name '{word}'{hint}")
    return cleaned
