"""Faults of a group rule: each has a separate code, name and page, so that it can be ignored alone.

They are listed in the module of the rule::

    01 loose-accuracy, warning, in ik: Inverse kinematics hardly fits poses. It stops where the error is still large.
    - <accuracy>0.5</accuracy>
    + <accuracy>1e-5</accuracy>

The code of a fault is that of its rule with two more digits. A name of the rule (in `--select`, a
comment, a setting or a baseline) therefore means all its faults. `ik` is the document around the
lines of the example. A fault with fixes states their kind: ``error, fix safe, in ik``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from osimlite.base.named_tuples import NamedTuple


class RuleFault(NamedTuple):
    """Fault of a group rule: suffix of its code, name, severity, fixes, example.

    In the `frame`, the `lines` of the example replace a line with {}.
    """

    number: str
    name: str
    severity: str
    fixes: str
    frame: str
    text: str
    lines: tuple[str, ...]

    @property
    def summary(self) -> str:
        """First sentence of the page."""
        return self.text.partition(". ")[0].rstrip(".") + "."

    def page(self, group: str) -> str:
        """Return the page of the fault; `group` is the code and the name of its rule."""
        reason = self.text.partition(". ")[2] or self.text
        fact = self.summary[0].lower() + self.summary[1:]
        return (
            f"{self.summary}\n\n## What it does\nReports every place where {fact} The rule belongs to "
            f"the group `{group}`.\n\n## Why is this bad\n{reason}\n\n## "
            f"Example\n{self._format_example('+')}\n\n## Use instead\n{self._format_example('-')}"
        )

    def _format_example(self, left_out: str) -> str:
        lines = [line[2:] for line in self.lines if line[0] != left_out]
        before, _, after = self.frame.partition("{}\n")
        before, start, margin = before.rpartition("\n")
        return before + start + "".join(f"{margin}{line}\n" for line in lines) + after


def parse_faults(fault_list: str, frames: Mapping[str, str]) -> Iterator[RuleFault]:
    """Yield the faults that a rule lists; `frames` are the documents of their examples by name."""
    sections: list[tuple[str, list[str], list[str]]] = []
    for line in fault_list.splitlines():
        if line[:2].isdigit():
            heading, _, text = line.partition(": ")
            sections.append((heading, [text], []))
        else:
            _, text_lines, lines = sections[-1]
            (lines if line[:2] in ("- ", "+ ", "  ") else text_lines).append(line)
    for heading, text_lines, lines in sections:
        name, severity, *fixes, frame = heading[3:].split(", ")
        kind = fixes[0].removeprefix("fix ") if fixes else ""
        yield RuleFault(
            heading[:2],
            name,
            severity,
            kind,
            frames[frame.removeprefix("in ")],
            " ".join(text_lines),
            tuple(lines),
        )
