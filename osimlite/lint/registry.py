"""Registry of rules, with the classes of a rule and of its callback.

A rule is a function of a subject and of `report`, which it calls once per finding. Its docstring is
the page that ``osimlite rule CODE`` prints.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from inspect import cleandoc
from typing import TYPE_CHECKING, Any, Literal, Unpack

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, replace
from osimlite.base.text import shorten_message
from osimlite.lint.diagnostic import Consequence, Finding, Fix, Severity
from osimlite.lint.faults import RuleFault, parse_faults

if TYPE_CHECKING:
    from osimlite.io.document.source import Position
    from osimlite.lint.checked import CheckTarget, LocationArguments
    from osimlite.schema.base import Object

ERROR, WARNING, INFO = Severity.ERROR, Severity.WARNING, Severity.INFO
REFUSES, FAILS = Consequence.REFUSES, Consequence.FAILS
NAN, RUNS = Consequence.NAN, Consequence.RUNS

FAMILIES = {
    "0": "text",
    "1": "structure",
    "2": "values",
    "3": "references",
    "4": "topology",
    "5": "physics",
    "6": "paths",
    "7": "files",
    "8": "data",
    "9": "trials",
}
"""Names of the families of rules by the first digit of their codes."""


class Threshold(NamedTuple):
    """Limit at which a rule starts to report, which a project can change.

    `name` is its key under ``[tool.osimlite.thresholds]``, `meaning` one phrase for the rule's page.
    """

    name: str
    default: float
    unit: str
    meaning: str


@dataclass(frozen=True, slots=True)
class FindingCollector:
    """Callback of a rule: each call adds a finding."""

    rules: dict[str, Rule]
    subject: CheckTarget
    findings: list[Finding]

    def __call__(
        self,
        message: str,
        item: Object | None = None,
        *,
        fault: str = "",
        at: Position | None = None,
        severity: Severity | None = None,
        consequence: Consequence | None = None,
        suggestion: str | None = None,
        certain: bool = False,
        fix: Fix | None = None,
        **location: Unpack[LocationArguments],
    ) -> None:
        """Add a finding at a position, which is given by `at` or as in :meth:`Subject.position`.

        A group rule names its `fault`; faults that are not selected are ignored. For rules on
        tables and documents with fixes, a suggestion becomes a fix: a safe one if it is `certain` or
        differs in letter case only.

        Args:
            message: sentence about the fault, its consequence in OpenSim, and the next step.
            item: object that has the fault.
            fault: name of the fault, in a group rule.
            at: position in the text.
            severity: severity of the finding; by default that of the rule.
            consequence: consequence in OpenSim, for an error of a rule with several consequences.
            suggestion: text that would be right at this position.
            certain: whether the suggestion is certainly right.
            fix: change of the text that removes the finding.
            **location: further arguments of :meth:`Subject.position`.
        """
        rule = self.rules.get(fault)
        subject = self.subject
        if rule is None:
            return
        # Severities in the settings do not change the consequence in OpenSim.
        severity = severity or rule.severity_in(subject.version)
        if at is None and (item is not None or location.get("number") is not None):
            at = subject.position(item, **location)
        line, column, length = at if at is not None else (None, None, 1)
        # Fixes of rules on models are made by the rules, which know what to rename; the others
        # replace the text at the position.
        if rule.fixes and rule.about != "model" and suggestion is not None and at is not None:
            named = location.get("word") or (
                item and getattr(item, location.get("attribute") or location.get("tag") or "name")
            )
            if suggestion == named:
                # The text is correct; what it refers to is wrong.
                suggestion = None
            else:
                fix = fix or subject.make_replacement(at, named, suggestion, certain=certain)
        elif subject.upgraded:
            # Findings on an upgraded document may not match its text.
            fix = None
        self.findings.append(
            Finding(
                rule.code,
                rule.name,
                subject.config.severity_of(rule, severity),
                shorten_message(message),
                subject.file,
                line,
                column,
                max(1, length),
                subject.path(item),
                suggestion,
                # Nor may findings on a text that was repaired for reading.
                None if subject.sure_until is not None else fix,
                rule.consequence_of(severity, consequence),
            )
        )


Check = Callable[[Any, FindingCollector], None]
FixKinds = Literal["", "safe", "unsafe", "both"]


@dataclass(frozen=True, slots=True)
class Rule:
    """Registered rule.

    `severity` is the default severity of its findings; `before` has another one for documents older
    than a version, which OpenSim treats differently. `fixes` is the kind of its fixes. `about` is
    the type of subject: ``model``, ``table``, ``document`` (a setup, or a part of one),
    ``measures`` (of the model's paths and muscles), ``construction`` (obstacles to the computation
    of a model), or ``trial`` (measurements of a finished trial). `consequences` lists the possible
    consequences of its errors in OpenSim: a single one holds for all errors; of several, each
    finding names its own. A rule that distinguishes faults is a `group`: there is a rule for each
    `fault`, all with the same `check`.
    """

    code: str
    name: str
    severity: Severity
    check: Check
    before: tuple[int, Severity] | None = None
    thresholds: tuple[Threshold, ...] = ()
    fixes: FixKinds = ""
    about: str = "model"
    fault: RuleFault | None = None
    group: str = ""
    consequences: tuple[Consequence, ...] = ()

    @property
    def family(self) -> str:
        """Family of rules to which the code belongs."""
        return FAMILIES[self.code[4]]

    @property
    def page(self) -> str:
        """Page of the rule: the paragraphs of its docstring on what it reports, why, and an example with its fix.

        The docstring has the example once, its lines marked as in a diff: `-` what fails, `+` what fixes it.
        """
        if self.fault is not None:
            return self.fault.page(f"{self.code[:-2]} {self.group}")
        # A page has exactly four parts separated by blank lines, as `rule` in CONTRIBUTING.md says;
        # a test checks each.
        summary, explanation, reason, example = cleandoc(self.check.__doc__ or "").split("\n\n", 3)
        fence, *lines, closing_fence = example.splitlines()
        # The lines with "-" are the example that fails, those with "+" the corrected one, and
        # others belong to both.
        fails, corrected = (
            "\n".join(line[2:] for line in lines if line[:1] != left_out) for left_out in "+-"
        )
        return (
            f"{summary}\n\n## What it does\n{explanation}\n\n## Why is this bad\n{reason}\n\n## "
            f"Example\n{fence}\n{fails}\n{closing_fence}\n\n## Use instead\n{fence}\n{corrected}\n{closing_fence}"
        )

    @property
    def summary(self) -> str:
        """First line of the page."""
        summary = (
            self.fault.summary
            if self.fault is not None
            else (self.check.__doc__ or "").partition("\n")[0]
        )
        return summary.rstrip(".")

    def severity_in(self, version: int | None) -> Severity:
        """Return the severity of findings in a document of a version; None stands for the current version."""
        if self.before is not None and version is not None and version < self.before[0]:
            return self.before[1]
        return self.severity

    def consequence_of(
        self, severity: Severity, stated: Consequence | None = None
    ) -> Consequence | None:
        """Return the consequence of a finding in OpenSim; None if the rule does not say.

        OpenSim runs files without errors, by the definition of :class:`Severity`.

        Args:
            severity: severity of the finding, before settings change it.
            stated: consequence that the finding names.
        """
        if severity is not ERROR:
            return RUNS
        if stated is None and len(self.consequences) == 1:
            return self.consequences[0]
        return stated

    def has_name(self, word: str) -> bool:
        """Return whether `word` is the code of this rule, a prefix of it, its name, or that of its group."""
        # An empty word would be a prefix of every code.
        return bool(word) and (
            self.code.startswith(word.upper()) or word in (self.name, self.group)
        )

    def matches(self, word: str) -> bool:
        """Return whether `word` names the rule or its family."""
        return self.has_name(word) or word in (self.family, "ALL")


_RULES: dict[str, Rule] = {}
_GROUPS: dict[str, Rule] = {}
_NAMES: set[str] = set()


def rule(
    code: str,
    name: str,
    *,
    severity: Severity,
    before: tuple[int, Severity] | None = None,
    thresholds: tuple[Threshold, ...] = (),
    fixes: FixKinds = "",
    about: str = "model",
    faults: str = "",
    frames: Mapping[str, str] | None = None,
    consequences: tuple[Consequence, ...] = (),
) -> Callable[[Check], Check]:
    """Register a function as the rule `code`; the other arguments are those of :class:`Rule`.

    With `faults` it is a group. The faults are listed in the form of :mod:`osimlite.lint.faults`,
    with examples in the documents of `frames`.

    Returns:
        A decorator, which leaves the function as it is.
    """

    def register(check: Check) -> Check:
        group_rule = Rule(
            code, name, severity, check, before, thresholds, fixes, about, consequences=consequences
        )
        if not faults:
            _register_rule(_RULES, group_rule)
            return check
        _register_rule(_GROUPS, group_rule)
        for fault in parse_faults(faults, frames or {}):
            fault_fields: Any = {
                "code": code + fault.number,
                "name": fault.name,
                "fixes": fault.fixes,
                "group": name,
            }
            _register_rule(
                _RULES,
                replace(group_rule, severity=Severity(fault.severity), fault=fault, **fault_fields),
            )
        return check

    return register


def _register_rule(table: dict[str, Rule], rule: Rule) -> None:
    # Names and codes are in baselines and comments of users, so they must be unique.
    if not _NAMES.isdisjoint((rule.code, rule.name)):
        raise ValueError(f"rule {rule.code} {rule.name} is registered twice")
    _NAMES.update((rule.code, rule.name))
    table[rule.code] = rule


RULE_MODULES: Mapping[str, tuple[str, ...]] = {
    "model": (
        "bodies",
        "classes",
        "construction",
        "contact",
        "coordinates",
        "custom_joints",
        "domains",
        "ends",
        "expressions",
        "files",
        "functions",
        "joints",
        "leftovers",
        "markup",
        "measured_muscles",
        "measured_paths",
        "muscles",
        "names",
        "paths",
        "physics",
        "references",
        "relations",
        "space",
        "structure",
        "text",
        "topology",
        "values",
        "versions",
        "wiring",
        "wraps",
    ),
    "document": (
        "moco",
        "setup_columns",
        "setup_files",
        "setup_geometry",
        "setup_loads",
        "setup_markers",
        "setup_names",
        "setup_scaling",
        "setup_sensors",
        "setup_tasks",
        "setup_times",
        "setup_tools",
        "setup_units",
    ),
    "table": ("marker_tables", "table_rows", "tables"),
    "trial": ("trial_forces", "trial_motion"),
}
"""Modules of `osimlite.lint.rules` by the type of subject that their rules check (`Rule.about`).

Modules are loaded only for subjects of their kind.
"""

DOCUMENT_MODULES = (
    "classes",
    "domains",
    "files",
    "leftovers",
    "markup",
    "relations",
    "structure",
    "text",
    "values",
    "versions",
)
"""Modules under "model" with rules on text, tags, values and files, which apply to every document."""


@cache
def all_rules(about: str = "") -> tuple[Rule, ...]:
    """Return every rule, sorted by code.

    Args:
        about: type of subject, such as "table"; modules for other types are not imported, and their
            rules may be missing. Empty for all.

    Returns:
        Rules of the loaded modules.
    """
    for subject, modules in RULE_MODULES.items():
        for module in modules:
            # Rules on text, tags and values apply to setups too.
            is_shared = about == "document" and module in DOCUMENT_MODULES
            if about in ("", subject) or is_shared:
                import_module(f"osimlite.lint.rules.{module}")
    return tuple(_RULES[code] for code in sorted(_RULES))


def rule_groups() -> tuple[Rule, ...]:
    """Return the groups of rules, sorted by code.

    Returns:
        One rule for each group, with its code and page.
    """
    all_rules()
    return tuple(_GROUPS[code] for code in sorted(_GROUPS))


def get_rule(code: str) -> Rule:
    """Return the rule with a code; its module must be loaded."""
    return _RULES[code]
