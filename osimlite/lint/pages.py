"""What there is to read about a rule: its page, and the index of all."""

from __future__ import annotations

from inspect import cleandoc

from osimlite.lint.registry import FAMILIES, Rule, all_rules, groups

_MENDS = {
    "": "none",
    "safe": "sometimes, by --fix",
    "unsafe": "sometimes, by --unsafe-fixes (look at it with --diff first)",
    "both": "sometimes, by --fix, or by --unsafe-fixes where it is a guess",
}
_INTRODUCTION = """\
# Rules

What `osimlite validate` looks for. `osimlite rule OSIM502` shows the page of a rule: what it finds, why that is bad, an
example, and the same mended.

An **error** is what OpenSim refuses, crashes on, computes NaN from, or reads differently from what is written. A
**warning** is physically or numerically doubtful; an **info** is untidy, or worth knowing. A finding may be more or
less severe than its rule where the file shows the reason. `--fix` makes **safe** fixes: OpenSim then reads the same
model, or the one that was certainly meant. An **unsafe** fix is a guess, which `--unsafe-fixes` makes."""
_SHORT = {"": "", "safe": "safe", "unsafe": "unsafe", "both": "safe or unsafe"}


def page_of(rule: Rule) -> str:
    """The page of a rule as Markdown: what its findings count as, whether they are mended, and its settings."""
    rows = [
        f"# {rule.name} ({rule.code})",
        "",
        f"Severity: {severity_of(rule)}",
        f"Fix: {_MENDS[rule.mends]}",
        "",
        rule.page,
    ]
    if rule.thresholds:
        rows += ["", "## Settings", "Under `[tool.osimlite.thresholds]`:", ""]
        rows += [
            f"- `{threshold.name} = {threshold.default:g}`{f' ({threshold.unit})' if threshold.unit else ''}: "
            f"{threshold.meaning}"
            for threshold in rule.thresholds
        ]
    return "\n".join(rows)


def group_page(group: Rule) -> str:
    """What the rules of a group have in common, as Markdown."""
    summary, what, why = cleandoc(group.check.__doc__ or "").split("\n\n")[:3]
    return f"# {group.name} ({group.code})\n\n{summary}\n\n{what}\n\n{why}"


def severity_of(rule: Rule) -> str:
    """``error; warning in files of a version before 30500``."""
    if rule.before is None:
        return rule.severity.value
    return f"{rule.severity.value}; {rule.before[1].value} in files of a version before {rule.before[0]}"


def index() -> str:
    """All rules and thresholds as one Markdown page; ``docs/rules.md`` is this text."""
    rows = [_INTRODUCTION]
    for digit, family in FAMILIES.items():
        rows += [
            "",
            f"## {family.capitalize()}",
            "",
            "| Code | Name | Severity | Fix | Finds |",
            "|---|---|---|---|---|",
        ]
        rows += [
            f"| {rule.code} | {rule.name} | {severity_of(rule)} | {_SHORT[rule.mends]} | {rule.summary} |"
            if rule not in groups()
            else f"| {rule.code} | {rule.name} | a group | | {rule.summary}: the codes that begin so |"
            for rule in sorted((*all_rules(), *groups()), key=lambda rule: rule.code)
            if rule.code[4] == digit
        ]
    rows += ["", "## Thresholds", "", "Under `[tool.osimlite.thresholds]`:", ""]
    rows += ["| Name | Default | Unit | Rule | What it is |", "|---|---|---|---|---|"]
    seen: dict[str, list[str]] = {}
    for rule in all_rules():
        for threshold in rule.thresholds:
            seen.setdefault(threshold.name, []).append(rule.code)
    known = {threshold.name: threshold for rule in all_rules() for threshold in rule.thresholds}
    rows += [
        f"| {name} | {known[name].default:g} | {known[name].unit} | {', '.join(codes)} | {known[name].meaning} |"
        for name, codes in seen.items()
    ]
    return "\n".join(rows) + "\n"
