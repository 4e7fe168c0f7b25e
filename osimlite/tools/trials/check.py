"""Whether a finished trial is good enough: what was measured of its files, judged by the rules of the linter."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from osimlite.base.records import dataclass, field
from osimlite.base.text import join_words
from osimlite.errors import OsimliteError
from osimlite.io.document.source import Source
from osimlite.lint.config import Config, checked_words
from osimlite.lint.diagnostic import Finding, Report
from osimlite.lint.engine import run, subject_of
from osimlite.lint.many import Texts, settings_of
from osimlite.lint.trial import Number, Trial, Verdict
from osimlite.mechanics.multibody.extremes import any_numbers
from osimlite.tools.trials.actuators import (
    activation_numbers,
    actuators_of,
    dynamics_numbers,
    reserve_numbers,
    residual_numbers,
)
from osimlite.tools.trials.fit import (
    Numbers,
    error_numbers,
    filter_numbers,
    marker_numbers,
    range_numbers,
    scale_numbers,
    tracking_numbers,
)
from osimlite.tools.trials.folder import LOADS, SETUPS, Folder, Missing, Tool
from osimlite.tools.trials.loads import Scale, feet_numbers, scale_of, weight_numbers
from osimlite.tools.trials.muscles import passive_numbers

NAMES = {"RRATool": "RRA", "CMCTool": "CMC", "AnalyzeTool": "static optimization"}
"""Of tools whose actuators are looked at."""
IN_SETUPS = ("OSIM844", "OSIM845", "OSIM846", "OSIM849", "OSIM857", "OSIM858", "OSIM859")
"""Rules about setups that ask the same: times, filters, units and loads."""


@dataclass(slots=True)
class TrialReport(Report):
    """What was found in a trial.

    Attributes:
        verdicts: every number that was compared with a limit.
        unchecked: what was not looked at, and why.
    """

    verdicts: list[Verdict] = field(default_factory=list)
    unchecked: list[str] = field(default_factory=list)

    @property
    def worst(self) -> list[Verdict]:
        """Of each kind of number in each file the one that is farthest beyond its limits."""
        result: dict[tuple[str, str, str, str], Verdict] = {}
        for verdict in self.verdicts:
            key = verdict.name, verdict.file, verdict.unit, verdict.of.partition(" of ")[0]
            if key not in result or _badness(verdict) > _badness(result[key]):
                result[key] = verdict
        return list(result.values())

    def as_dict(self) -> dict[str, Any]:
        """All that was found, as JSON has it."""
        return {
            "findings": [finding.as_dict() for finding in self.findings],
            "verdicts": [verdict._asdict() for verdict in self.verdicts],
            "unchecked": self.unchecked,
        }


def _badness(verdict: Verdict) -> float:
    return verdict.value / verdict.bad if verdict.bad else verdict.value


@any_numbers
def check_trial(
    *paths: str | Path,
    select: tuple[str, ...] | list[str] | str | None = None,
    ignore: tuple[str, ...] | list[str] | str | None = None,
    config: Config | None = None,
    written: Iterable[Path] = (),
    progress: Callable[[int, int], object] | None = None,
) -> TrialReport:
    """Check finished trials: is the model strong enough, are the data good?

    Args: paths: folders with setups and what these wrote, by OpenSim or by :func:`osimlite.run`; or
        setups. select: codes, beginnings of codes, or names of rules to run; all that are about
        trials if not given. ignore: the same, of rules to leave out. config: everything that can be
        set; `select` and `ignore` take its place. written: results of the setups that are in
        another place. progress: is told how many setups are done, of how many.

    Returns: Findings, as of :func:`osimlite.validate`; all numbers with their limits, and what was
        not looked at.

    Raises:
        MissingFileError: a path is not there.
        OsimliteError: there is nothing of a trial, or no rule has a code in `select` or `ignore`.
    """
    given = config or Config(checked_words(select), checked_words(ignore))
    folder = Folder(paths or (".",), written)
    numbers: dict[Path, list[Number]] = {}
    unchecked: dict[str, None] = {}
    looked: dict[str, None] = {}
    measures = [*_measures(folder)]
    for count, (what, measure) in enumerate(measures, start=1):
        try:
            for file, number in measure():
                numbers.setdefault(file, []).append(number)
        except OsimliteError as error:
            unchecked[f"{what}: {error.message if isinstance(error, Missing) else error}"] = None
        if progress is not None:
            progress(count, len(measures))
    if not folder.tools and not numbers:
        raise OsimliteError(
            f"there is nothing of a trial here: no setup of {', '.join(SETUPS[:-1])} or {SETUPS[-1]}, and no results",
            file=", ".join(map(str, paths)),
        )
    report = TrialReport(texts=Texts(), unchecked=[*unchecked])
    findings: list[Finding] = []
    for file, own in numbers.items():
        looked[str(file)] = None
        trial = Trial(
            str(file),
            Source.of_file(file).data,
            own,
            settings_of(str(file)).config_for(file, given),
        )
        findings += run(trial).findings
        report.verdicts += trial.verdicts
    for name in _documents(folder):
        own_config = settings_of(name).config_for(name, given)
        subject = subject_of(name, own_config)
        findings += [
            item for item in run(subject, measure=False) if item.code.startswith(IN_SETUPS)
        ]
        looked[name] = None
    report.findings = sorted(
        dict.fromkeys(findings), key=lambda item: (item.severity.rank, item.file or "")
    )
    report.checked = len(looked)
    return report


def _documents(folder: Folder) -> Iterator[str]:
    """The setups, and the loads that they name."""
    names: dict[str, None] = {}
    for tool in folder.tools:
        names[str(tool.job.file)] = None
        try:
            file = tool.input(LOADS)
        except Missing:
            continue
        if file is not None:
            names[str(file)] = None
    yield from names


Measure = tuple[str, Callable[[], Numbers]]


def _measures(folder: Folder) -> Iterator[Measure]:
    """What is measured: in words, and how."""
    looked: set[tuple[object, ...]] = set()
    claimed: set[Path] = set()
    followed = any(
        tool.tag in ("RRATool", "CMCTool") and _results(tool, "_Actuation_force.sto")
        for tool in folder.tools
    )
    for tool in folder.tools:
        if tool.tag == "ScaleTool":
            yield "errors of the scaled model's markers", partial(scale_numbers, tool)
        elif tool.tag == "InverseKinematicsTool":
            yield "errors of markers", partial(marker_numbers, tool)
            motion = folder.near(tool.job.result(tool.setup.output_motion_file.strip() or "-"))
            if motion is not None:
                yield "ranges of coordinates", partial(range_numbers, tool, motion)
        elif tool.tag == "InverseDynamicsTool":
            yield "residuals", partial(dynamics_numbers, tool, is_final=not followed)
        elif tool.tag in ("RRATool", "CMCTool"):
            yield from _of_tracking(tool, folder.tools, claimed)
        elif tool.tag == "AnalyzeTool":
            yield from _of_optimization(tool, folder.tools, claimed)
        if tool.tag not in ("ScaleTool", "InverseKinematicsTool"):
            yield from _of_inputs(tool, looked)
    if folder.is_whole:
        yield from _without_setup(folder, claimed)


def _results(tool: Tool, ending: str) -> Path | None:
    return tool.result(f"{tool.setup.name}{ending}")


def _of_inputs(tool: Tool, looked: set[tuple[object, ...]]) -> Iterator[Measure]:
    """What motion and loads say of each other, once for each pair of them."""
    try:
        motion, loads = (
            tool.input(*tags)
            for tags in (("coordinates_file", "desired_kinematics_file"), (LOADS,))
        )
    except Missing as error:
        yield "motion and loads", partial(_missing, error)
        return
    if motion is None:
        if tool.tag != "AnalyzeTool":
            yield "motion and loads", partial(_missing, Missing(f"{tool} names no motion"))
        return
    if (motion, tool.cutoff, tool.span) not in looked:
        looked.add((motion, tool.cutoff, tool.span))
        yield "filters", partial(filter_numbers, tool)
    if loads is None:
        yield "loads", partial(_missing, Missing(f"{tool} names no external loads"))
    else:
        if (loads,) not in looked:
            looked.add((loads,))
            yield "feet under loads", partial(feet_numbers, tool)
        if (loads, tool.setup.model_file) not in looked:
            looked.add((loads, tool.setup.model_file))
            yield "weight on plates", partial(weight_numbers, tool)


def _missing(error: Missing) -> Numbers:
    raise error


def _of_tracking(tool: Tool, others: Sequence[Tool], claimed: set[Path]) -> Iterator[Measure]:
    """Results of RRA and CMC."""
    folder = tool.folder
    force, error = _results(tool, "_Actuation_force.sto"), _results(tool, "_pErr.sto")
    claimed.update(file for file in (force, error) if file is not None)
    if force is None:
        gone = Missing(
            f"the forces of {tool} are missing ('{tool.setup.name}_Actuation_force.sto'); run it in OpenSim"
        )
        yield "residuals", partial(_missing, gone)
    else:
        yield "residuals", partial(_residuals, tool, force)
        if tool.tag == "CMCTool":
            yield "reserves", partial(_reserves, tool, force, others)
    if error is None:
        yield (
            "errors of tracking",
            partial(_missing, Missing(f"'{tool.setup.name}_pErr.sto' of {tool} is missing")),
        )
    else:
        yield "errors of tracking", partial(tracking_numbers, folder, error, tool)
    motion = _results(tool, "_Kinematics_q.sto")
    if motion is not None:
        yield "ranges of coordinates", partial(range_numbers, tool, motion)
    if tool.tag == "CMCTool":
        states = _results(tool, "_states.sto") or _results(tool, "_controls.sto")
        if states is None:
            yield (
                "activations",
                partial(_missing, Missing(f"'{tool.setup.name}_states.sto' of {tool} is missing")),
            )
        else:
            claimed.add(states)
            yield "activations", partial(_activations, tool, states)
        yield "passive forces", partial(passive_numbers, tool, _results(tool, "_states.sto"))


def _of_optimization(tool: Tool, others: Sequence[Tool], claimed: set[Path]) -> Iterator[Measure]:
    """Results of StaticOptimization."""
    for item in tool.setup.analysis_set.objects:
        if type(item).__name__ != "StaticOptimization" or not item.on:
            continue
        for ending in ("force", "activation"):
            file = _results(tool, f"_{item.name}_{ending}.sto")
            if file is None:
                gone = Missing(
                    f"'{tool.setup.name}_{item.name}_{ending}.sto' of {tool} is missing; run it"
                )
                yield (
                    ("residuals and reserves" if ending == "force" else "activations"),
                    partial(_missing, gone),
                )
                continue
            claimed.add(file)
            if ending == "force":
                yield "residuals", partial(_residuals, tool, file)
                yield "reserves", partial(_reserves, tool, file, others)
            else:
                yield "activations", partial(_activations, tool, file)
        yield "passive forces", partial(passive_numbers, tool, None)


def _residuals(tool: Tool, file: Path) -> Numbers:
    units = actuators_of(tool).residuals
    if not any(column in units for column in tool.folder.table(file).columns):
        raise Missing(f"{tool} has no residual actuators")
    return residual_numbers(tool.folder, file, units, scale_of(tool), NAMES[tool.tag])


def _reserves(tool: Tool, file: Path, others: Sequence[Tool]) -> Numbers:
    return reserve_numbers(tool, file, actuators_of(tool), others)


def _activations(tool: Tool, file: Path) -> Numbers:
    return activation_numbers(tool.folder, file, actuators_of(tool).muscles)


def _without_setup(folder: Folder, claimed: set[Path]) -> Iterator[Measure]:
    """Results whose setup is not there: what their names and labels tell."""
    has = {tool.tag for tool in folder.tools}
    if not has & {"RRATool", "CMCTool"}:
        for file in folder.ending("_Actuation_force.sto", "_StaticOptimization_force.sto"):
            if file not in claimed:
                units = actuators_of(None).residuals
                yield (
                    "residuals",
                    partial(residual_numbers, folder, file, units, Scale(), f"'{file.name}'"),
                )
        for file in folder.ending("_pErr.sto"):
            yield "errors of tracking", partial(tracking_numbers, folder, file, None)
    if "InverseKinematicsTool" not in has:
        for file in folder.ending("_ik_marker_errors.sto"):
            yield "errors of markers", partial(error_numbers, folder, file)
    lacking = [tag for tag in SETUPS if tag not in has]
    if lacking:
        yield "all else", partial(_missing, Missing(f"there is no setup of {join_words(lacking)}"))
