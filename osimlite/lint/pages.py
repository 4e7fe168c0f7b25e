"""Pages of rules and the index of all rules, as Markdown."""

from __future__ import annotations

from inspect import cleandoc

from osimlite.lint.registry import (
    ERROR,
    FAILS,
    FAMILIES,
    NAN,
    REFUSES,
    RUNS,
    Rule,
    all_rules,
    rule_groups,
)

_FIX_TEXTS = {
    "": "none",
    "safe": "sometimes, with --fix",
    "unsafe": "sometimes, with --unsafe-fixes (check it with --diff first)",
    "both": "sometimes: with --fix, or with --unsafe-fixes if the fix is a guess",
}
_CONSEQUENCE_TEXTS = {
    REFUSES: "rejects the file",
    FAILS: "fails when it needs the faulty part",
    NAN: "computes NaN",
    RUNS: "accepts the file but may compute something different from what is written",
}
_INTRODUCTION = """\
# Rules

The rules of `osimlite validate`. `osimlite rule OSIM502` prints the page of a rule: what it reports, why that is bad, an
example, and the same example fixed.

An **error** is something that OpenSim rejects, crashes on, computes NaN from, or reads differently from what is written.
A **warning** is physically or numerically doubtful. An **info** is untidy, or worth knowing. A finding may have another
severity than its rule if the file shows a reason for it. `--fix` makes **safe** fixes: OpenSim then reads the same model,
or the one that was certainly meant. An **unsafe** fix is a guess; `--unsafe-fixes` makes it.

The column **OpenSim** is about errors: OpenSim **refuses** the file or the model (or crashes or hangs), loads it and
**fails** as soon as it needs the faulty part, computes **nan**, or **runs** it, but may compute something
different from what the file describes. The column is empty if the rule does not say. In `--format json`, each finding
has one of these words as `consequence`: for a warning or an info it is `runs`."""
_SHORT = {"": "", "safe": "safe", "unsafe": "unsafe", "both": "safe or unsafe"}


def format_rule_page(rule: Rule) -> str:
    """Return the page of a rule as Markdown: its severity, its fixes, its text and its settings."""
    rows = [
        f"# {rule.name} ({rule.code})",
        "",
        f"Severity: {describe_severity(rule)}",
        f"Fix: {_FIX_TEXTS[rule.fixes]}",
        *(
            [f"{_label_consequences(rule)}: {describe_consequences(rule)}"]
            if rule.consequences
            else []
        ),
        "",
        rule.page,
    ]
    if rule.thresholds:
        rows += ["", "## Settings", "Under `[tool.osimlite.thresholds]`:", ""]
        rows += [
            f"- `{threshold.name} = "
            f"{threshold.default:g}`{f' ({threshold.unit})' if threshold.unit else ''}: "
            f"{threshold.meaning}"
            for threshold in rule.thresholds
        ]
    return "\n".join(rows)


def format_group_page(group: Rule) -> str:
    """Return the common page of the rules of a group as Markdown."""
    summary, explanation, reason = cleandoc(group.check.__doc__ or "").split("\n\n")[:3]
    return f"# {group.name} ({group.code})\n\n{summary}\n\n{explanation}\n\n{reason}"


def describe_severity(rule: Rule) -> str:
    """Return the severity of a rule, such as ``error; warning in files of a version before 30500``."""
    if rule.before is None:
        return rule.severity.value
    return (
        f"{rule.severity.value}; {rule.before[1].value} in files of a version before "
        f"{rule.before[0]}"
    )


def _label_consequences(rule: Rule) -> str:
    # Consequences are those of errors; a rule of another severity reports errors as well.
    return "OpenSim" if rule.severity is ERROR else "OpenSim, if the finding is an error"


def describe_consequences(rule: Rule) -> str:
    """Return the consequences of the errors of a rule, such as ``computes NaN``; "" if unknown."""
    if not rule.consequences:
        return ""
    first, *others = map(_CONSEQUENCE_TEXTS.__getitem__, rule.consequences)
    return f"in some cases it {first}; in others it {', or '.join(others)}" if others else first


def format_index() -> str:
    """Return all rules and thresholds as one Markdown page, which is ``docs/rules.md``."""
    rows = [_INTRODUCTION]
    for digit, family in FAMILIES.items():
        rows += [
            "",
            f"## {family.capitalize()}",
            "",
            "| Code | Name | Severity | Fix | OpenSim | Reports |",
            "|---|---|---|---|---|---|",
        ]
        rows += [
            f"| {rule.code} | {rule.name} | {describe_severity(rule)} | {_SHORT[rule.fixes]} | "
            f"{', '.join(rule.consequences)} | {rule.summary} |"
            if rule not in rule_groups()
            else f"| {rule.code} | {rule.name} | a group | | | {rule.summary}: the codes that begin with {rule.code} |"
            for rule in sorted((*all_rules(), *rule_groups()), key=lambda rule: rule.code)
            if rule.code[4] == digit
        ]
    rows += ["", "## Thresholds", "", "Under `[tool.osimlite.thresholds]`:", ""]
    rows += ["| Name | Default | Unit | Rule | Meaning |", "|---|---|---|---|---|"]
    codes_by_name: dict[str, list[str]] = {}
    for rule in all_rules():
        for threshold in rule.thresholds:
            codes_by_name.setdefault(threshold.name, []).append(rule.code)
    thresholds = {
        threshold.name: threshold for rule in all_rules() for threshold in rule.thresholds
    }
    rows += [
        f"| {name} | {thresholds[name].default:g} | {thresholds[name].unit} | {', '.join(codes)} | "
        f"{thresholds[name].meaning} |"
        for name, codes in codes_by_name.items()
    ]
    return "\n".join(rows) + "\n"
