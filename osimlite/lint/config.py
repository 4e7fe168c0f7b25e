"""What a check is asked to look for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from osimlite.errors import OsimliteError
from osimlite.lint.diagnostic import Severity

if TYPE_CHECKING:
    from osimlite.lint.engine import Rule


@dataclass(frozen=True, slots=True)
class Config:
    """Which rules run, and how bad their findings are.

    `select` and `ignore` hold codes (``OSIM301``), the beginning of codes (``OSIM3``) or names of rules
    (``unresolved-reference``); an empty `select` means all. `severity` overrides that of a rule. `mesh_paths` are
    folders where meshes are looked for besides OpenSim's own places.
    """

    select: tuple[str, ...] = ()
    ignore: tuple[str, ...] = ()
    severity: Mapping[str, Severity] = field(default_factory=dict)
    mesh_paths: tuple[str, ...] = ()

    def wants(self, rule: Rule) -> bool:
        """Whether a rule runs."""
        selected = not self.select or any(rule.matches(word) for word in self.select)
        return selected and not any(rule.matches(word) for word in self.ignore)

    def severity_of(self, rule: Rule, own: Severity) -> Severity:
        """The severity of a finding that its rule calls `own`."""
        for word, severity in self.severity.items():
            if rule.matches(word):
                return severity
        return own


def checked_words(words: tuple[str, ...] | list[str] | str | None) -> tuple[str, ...]:
    """Codes or names as a tuple; a text may hold several with commas between.

    Raises:
        OsimliteError: no rule has such a code or name.
    """
    given = words.split(",") if isinstance(words, str) else [part for word in words or () for part in word.split(",")]
    cleaned = tuple(word.strip() for word in given if word.strip())
    if not cleaned:
        return ()
    from osimlite.lint.engine import all_rules

    for word in cleaned:
        if not any(rule.matches(word) for rule in all_rules()):
            from osimlite.text import did_you_mean

            known = [name for rule in all_rules() for name in (rule.code, rule.name)]
            raise OsimliteError(
                f"no rule has the code or name '{word}'{did_you_mean(word, known)} `osimlite rule` lists all rules"
            )
    return cleaned
