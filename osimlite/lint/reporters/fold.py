"""What is alike in a file, for people: one finding stands for all that say the same of other names."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import NamedTuple

from osimlite.lint.diagnostic import Finding
from osimlite.text import listed

MANY = 4
"""So many findings that are alike are folded; fewer are as quickly read."""

_ONE_CAUSE = {"OSIM701"}
"""Rules whose findings in one file are mended together: two are folded already."""

# A name in quotes, a number with what is written to it.
_PARTICULAR = re.compile(r"'[^']*'|(?<![\w])[-+]?[\d.][\w.+-]*")


class Fold(NamedTuple):
    """A finding, and those in the same file that are like it."""

    first: Finding
    more: list[Finding]

    @property
    def remark(self) -> str:
        """``91 more like this, on lines 12, 40 and 88 more``, or an empty text if there are none."""
        if not self.more:
            return ""
        lines = list(dict.fromkeys(str(finding.line) for finding in self.more if finding.line is not None))
        first = f", on line{'s' * (len(lines) > 1)} {listed(lines, most=4)}" if lines else ""
        return f"{len(self.more)} more like this{first}"


def folded(findings: Iterable[Finding], *, everything: bool = False) -> list[Fold]:
    """Findings in their order, those that are alike under the first of them; `everything` folds none."""
    alike: dict[tuple[object, ...], list[tuple[int, Finding]]] = {}
    for number, finding in enumerate(findings):
        words = _PARTICULAR.sub("", finding.message)
        key = (number,) if everything else (finding.file, finding.code, finding.severity, words)
        alike.setdefault(key, []).append((number, finding))
    folds: list[tuple[int, Fold]] = []
    for group in alike.values():
        (number, first), more = group[0], [finding for _, finding in group[1:]]
        if len(group) < (2 if first.code in _ONE_CAUSE else MANY):
            folds += [(place, Fold(finding, [])) for place, finding in group]
        else:
            folds.append((number, Fold(first, more)))
    return [fold for _, fold in sorted(folds, key=lambda each: each[0])]


def told(folds: Iterable[Fold]) -> str:
    """How to see what is folded, or an empty text if nothing is."""
    return "--all prints what is folded." if any(fold.more for fold in folds) else ""
