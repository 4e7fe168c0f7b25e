"""What is alike, for people: one finding stands for those that say the same, of other names in a file or in others."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Hashable, Iterable
from typing import NamedTuple, TypeVar

from osimlite.base.text import listed
from osimlite.lint.diagnostic import Finding

T = TypeVar("T")

MANY = 4
"""So many findings that are alike are folded, and so many files that say the same; fewer are as quickly read."""

_ONE_CAUSE = {"OSIM701"}
"""Rules whose findings are mended together: two are folded already."""

# A name in quotes, or a tag; a number with what is written to it, or a path.
_NAMES = re.compile(r"'[^']*'|<\w+>")
_NUMBERS = re.compile(r"(?<!\S)[^\s']*/[^\s']*|(?<!\w)[-+]?[\d.][\w.+-]*")


class Fold(NamedTuple):
    """A finding, those in the same file that are like it, and those in other files that say the same."""

    first: Finding
    more: list[Finding]
    elsewhere: list[Finding]

    @property
    def remarks(self) -> list[str]:
        """``91 more like this, on lines 12, 40 and 88 more``; nothing if there are none."""
        result = []
        if self.more:
            lines = list(
                dict.fromkeys(
                    str(finding.line) for finding in self.more if finding.line is not None
                )
            )
            places = f", on line{'s' * (len(lines) > 1)} {listed(lines, most=4)}" if lines else ""
            result.append(f"{len(self.more)} more like this{places}")
        if self.elsewhere:
            files = dict.fromkeys(
                os.path.basename(finding.file or "") for finding in self.elsewhere
            )
            result.append(f"{len(self.elsewhere)} more in other files: {listed(files, most=3)}")
        return result


def folded(findings: Iterable[Finding], *, everything: bool = False) -> list[Fold]:
    """Findings in their order, those that are alike under the first of them; `everything` folds none."""
    every = list(findings)
    if everything:
        return [Fold(finding, [], []) for finding in every]
    parts = [
        part
        for group in _grouped(every, lambda finding: (finding.file, *_kind(finding, names=False)))
        for part in (
            [group] if len(group) >= _least(group[0]) else [[finding] for finding in group]
        )
    ]
    result: list[Fold] = []
    # What other files say is the same only with the same names, unless there is one cause.
    for alike in _grouped(parts, lambda part: _kind(part[0], names=part[0].code not in _ONE_CAUSE)):
        first, *rest = [finding for part in alike for finding in part]
        if len({part[0].file for part in alike}) < _least(first):
            result += [Fold(part[0], part[1:], []) for part in alike]
        else:
            here = [finding for finding in rest if finding.file == first.file]
            result.append(
                Fold(first, here, [finding for finding in rest if finding.file != first.file])
            )
    place = {id(finding): number for number, finding in enumerate(every)}
    return sorted(result, key=lambda fold: place[id(fold.first)])


def _least(finding: Finding) -> int:
    return 2 if finding.code in _ONE_CAUSE else MANY


def _kind(finding: Finding, *, names: bool) -> tuple[object, ...]:
    """What findings that are alike have in common: the same words, perhaps with the same names."""
    words = finding.message if names else _NAMES.sub("", finding.message)
    return finding.code, finding.severity, _NUMBERS.sub("", words)


def _grouped(items: Iterable[T], key: Callable[[T], Hashable]) -> list[list[T]]:
    groups: dict[Hashable, list[T]] = {}
    for item in items:
        groups.setdefault(key(item), []).append(item)
    return list(groups.values())


def told(folds: Iterable[Fold]) -> str:
    """How to see what is folded, or an empty text if nothing is."""
    return "--all prints what is folded." if any(fold.remarks for fold in folds) else ""
