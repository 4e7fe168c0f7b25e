"""Check of finished trials: measurements of their files, judged by rules of the linter."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from math import isnan
from pathlib import Path
from typing import Any

from osimlite.base.records import dataclass, field
from osimlite.base.text import join_words
from osimlite.errors import OsimliteError
from osimlite.io.document.source import Source
from osimlite.lint.config import Config, parse_codes
from osimlite.lint.diagnostic import Finding, Report
from osimlite.lint.engine import load_subject, run_rules
from osimlite.lint.many import SourceTexts, find_settings
from osimlite.lint.trial import Measurement, Trial, TrialVerdict
from osimlite.mechanics.multibody.extremes import any_numbers
from osimlite.tools.trials.actuators import (
    find_actuators,
    measure_activations,
    measure_inverse_dynamics,
    measure_reserves,
    measure_residuals,
)
from osimlite.tools.trials.fit import (
    Numbers,
    measure_filter,
    measure_marker_errors,
    measure_ranges,
    measure_scale_errors,
    measure_tracking_errors,
    measure_written_errors,
)
from osimlite.tools.trials.folder import LOADS, SETUPS, MissingInput, TrialFolder, TrialTool
from osimlite.tools.trials.loads import LoadScale, compute_scale, measure_feet, measure_weight
from osimlite.tools.trials.muscles import measure_passive_forces

TOOL_NAMES = {"RRATool": "RRA", "CMCTool": "CMC", "AnalyzeTool": "static optimization"}
"""Names, in messages, of tools whose actuators are measured."""
SETUP_RULES = ("OSIM844", "OSIM845", "OSIM846", "OSIM849", "OSIM857", "OSIM858", "OSIM859")
"""Rules about setups that concern trials as well: times, filters, units and loads."""


@dataclass(slots=True)
class TrialReport(Report):
    """Findings and verdicts about a trial.

    Attributes:
        verdicts: measured numbers with their limits.
        unchecked: sentences about parts that could not be checked, with the reasons.
    """

    verdicts: list[TrialVerdict] = field(default_factory=list)
    unchecked: list[str] = field(default_factory=list)

    @property
    def worst(self) -> list[TrialVerdict]:
        """Verdict of each kind in each file that is farthest beyond its limits."""
        result: dict[tuple[str, str, str, str], TrialVerdict] = {}
        for verdict in self.verdicts:
            # Verdicts about several parts of one kind, such as markers, count as one.
            key = verdict.name, verdict.file, verdict.unit, verdict.of.partition(" of ")[0]
            if key not in result or _compute_badness(verdict) > _compute_badness(result[key]):
                result[key] = verdict
        return list(result.values())

    def as_dict(self) -> dict[str, Any]:
        """Return the report as a dictionary for JSON, in which missing measurements are None.

        Returns:
            Findings, verdicts and unchecked parts, by these names.
        """
        return {
            "findings": [finding.as_dict() for finding in self.findings],
            "verdicts": [
                {
                    key: None if isinstance(value, float) and isnan(value) else value
                    for key, value in verdict._asdict().items()
                }
                for verdict in self.verdicts
            ],
            "unchecked": self.unchecked,
        }


def _compute_badness(verdict: TrialVerdict) -> float:
    """Return the value of a verdict relative to its limit."""
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
    """Check finished trials: are the data good, and is the model strong enough?

    Args:
        paths: folders with setups and their results, written by OpenSim or by :func:`osimlite.run`;
            or setup files.
        select: codes, prefixes of codes, or names of the rules to run; all rules about trials by
            default.
        ignore: codes, prefixes of codes, or names of rules to leave out.
        config: complete settings, instead of `select` and `ignore`.
        written: results of the setups that are in other folders.
        progress: function that receives the number of finished measurements and of all
            measurements.

    Returns:
        Findings, as of :func:`osimlite.validate`; measured numbers with their limits; and what
        could not be checked.

    Raises:
        MissingFileError: a path does not exist.
        OsimliteError: there is no part of a trial, or no rule has a code in `select` or `ignore`.
    """
    base_config = config or Config(parse_codes(select), parse_codes(ignore))
    folder = TrialFolder(paths or (".",), written)
    numbers: dict[Path, list[Measurement]] = {}
    # Dictionaries serve as sets that keep their order, so that reports are reproducible.
    unchecked: dict[str, None] = {}
    checked_files: dict[str, None] = {}
    measures = [*_plan_measurements(folder)]
    for count, (description, measure) in enumerate(measures, start=1):
        try:
            for file, number in measure():
                numbers.setdefault(file, []).append(number)
        # One missing input must not hide all other results.
        except OsimliteError as error:
            unchecked[
                f"{description}: {error.message if isinstance(error, MissingInput) else error}"
            ] = None
        if progress is not None:
            progress(count, len(measures))
    if not folder.tools and not numbers:
        raise OsimliteError(
            f"this is not a trial: it has no setup of {', '.join(SETUPS[:-1])} or {SETUPS[-1]}, "
            "and no results",
            file=", ".join(map(str, paths)),
        )
    report = TrialReport(texts=SourceTexts(), unchecked=[*unchecked])
    findings: list[Finding] = []
    for file, file_numbers in numbers.items():
        checked_files[str(file)] = None
        trial = Trial(
            str(file),
            Source.from_file(file).data,
            file_numbers,
            find_settings(str(file)).config_for(file, base_config),
        )
        findings += run_rules(trial).findings
        report.verdicts += trial.verdicts
    for name in _find_documents(folder):
        file_config = find_settings(name).config_for(name, base_config)
        subject = load_subject(name, file_config)
        findings += [
            finding
            for finding in run_rules(subject, measure=False)
            if finding.code.startswith(SETUP_RULES)
        ]
        checked_files[name] = None
    report.findings = sorted(
        # Tools that name the same file have the same findings.
        dict.fromkeys(findings),
        key=lambda finding: (finding.severity.rank, finding.file or ""),
    )
    report.checked = len(checked_files)
    return report


def _find_documents(folder: TrialFolder) -> Iterator[str]:
    """Yield the setups, and the loads that they name."""
    names: dict[str, None] = {}
    for tool in folder.tools:
        names[str(tool.job.file)] = None
        try:
            file = tool.find_input(LOADS)
        except MissingInput:
            continue
        if file is not None:
            names[str(file)] = None
    yield from names


PlannedMeasurement = tuple[str, Callable[[], Numbers]]
"""Description of a measurement, and the function that makes it."""


def _plan_measurements(folder: TrialFolder) -> Iterator[PlannedMeasurement]:
    """Yield all measurements of a trial."""
    checked_inputs: set[tuple[object, ...]] = set()
    claimed: set[Path] = set()
    # RRA and CMC reduce the residuals of inverse dynamics, which then are not the final ones.
    followed = any(
        tool.tag in ("RRATool", "CMCTool") and _find_result(tool, "_Actuation_force.sto")
        for tool in folder.tools
    )
    for tool in folder.tools:
        if tool.tag == "ScaleTool":
            yield "errors of the scaled model's markers", partial(measure_scale_errors, tool)
        elif tool.tag == "InverseKinematicsTool":
            yield "errors of markers", partial(measure_marker_errors, tool)
            motion = folder.find_file(
                tool.job.get_output_path(tool.setup.output_motion_file.strip() or "-")
            )
            if motion is not None:
                yield "ranges of coordinates", partial(measure_ranges, tool, motion)
        elif tool.tag == "InverseDynamicsTool":
            yield "residuals", partial(measure_inverse_dynamics, tool, is_final=not followed)
        elif tool.tag in ("RRATool", "CMCTool"):
            yield from _plan_tracking(tool, folder.tools, claimed)
        elif tool.tag == "AnalyzeTool":
            yield from _plan_static_optimization(tool, folder.tools, claimed)
        if tool.tag not in ("ScaleTool", "InverseKinematicsTool"):
            yield from _plan_inputs(tool, checked_inputs)
    # Files that the user names singly are not searched for results of other tools.
    if folder.has_folder:
        yield from _plan_results_without_setup(folder, claimed)


def _find_result(tool: TrialTool, ending: str) -> Path | None:
    """Return the path of a result of a tool by the end of its name; None if it is missing."""
    return tool.find_result(f"{tool.setup.name}{ending}")


def _plan_inputs(tool: TrialTool, planned: set[tuple[object, ...]]) -> Iterator[PlannedMeasurement]:
    """Yield the measurements of motion and loads, once for each pair of them.

    Args:
        tool: tool that names them.
        planned: inputs whose measurements have been planned for another tool; extended.
    """
    try:
        motion, loads = (
            tool.find_input(*tags)
            for tags in (("coordinates_file", "desired_kinematics_file"), (LOADS,))
        )
    except MissingInput as error:
        yield "motion and loads", partial(_raise_missing, error)
        return
    if motion is None:
        # An AnalyzeTool may read states instead of coordinates.
        if tool.tag != "AnalyzeTool":
            yield (
                "motion and loads",
                partial(_raise_missing, MissingInput(f"{tool} names no motion")),
            )
        return
    if (motion, tool.cutoff, tool.span) not in planned:
        planned.add((motion, tool.cutoff, tool.span))
        yield "filters", partial(measure_filter, tool)
    if loads is None:
        yield "loads", partial(_raise_missing, MissingInput(f"{tool} names no external loads"))
    else:
        # Several tools of a trial name the same files.
        if (loads,) not in planned:
            planned.add((loads,))
            yield "feet under loads", partial(measure_feet, tool)
        if (loads, tool.setup.model_file) not in planned:
            planned.add((loads, tool.setup.model_file))
            yield "weight on plates", partial(measure_weight, tool)


def _raise_missing(error: MissingInput) -> Numbers:
    """Raise an error in place of a measurement."""
    raise error


def _plan_tracking(
    tool: TrialTool, tools: Sequence[TrialTool], claimed: set[Path]
) -> Iterator[PlannedMeasurement]:
    """Yield the measurements of results of RRA and CMC.

    Args:
        tool: setup whose results are measured.
        tools: setups of all tools of the trial.
        claimed: set to which the measured files are added.
    """
    folder = tool.folder
    force = _find_result(tool, "_Actuation_force.sto")
    error = _find_result(tool, "_pErr.sto")
    claimed.update(file for file in (force, error) if file is not None)
    if force is None:
        missing_error = MissingInput(
            f"the forces of {tool} are missing ('{tool.setup.name}_Actuation_force.sto'); run this setup"
        )
        yield "residuals", partial(_raise_missing, missing_error)
    else:
        yield "residuals", partial(_measure_residuals, tool, force)
        if tool.tag == "CMCTool":
            yield "reserves", partial(_measure_reserves, tool, force, tools)
    if error is None:
        yield (
            "errors of tracking",
            partial(
                _raise_missing, MissingInput(f"'{tool.setup.name}_pErr.sto' of {tool} is missing")
            ),
        )
    else:
        yield "errors of tracking", partial(measure_tracking_errors, folder, error, tool)
    motion = _find_result(tool, "_Kinematics_q.sto")
    if motion is not None:
        yield "ranges of coordinates", partial(measure_ranges, tool, motion)
    if tool.tag == "CMCTool":
        states = _find_result(tool, "_states.sto") or _find_result(tool, "_controls.sto")
        if states is None:
            yield (
                "activations",
                partial(
                    _raise_missing,
                    MissingInput(f"'{tool.setup.name}_states.sto' of {tool} is missing"),
                ),
            )
        else:
            claimed.add(states)
            yield "activations", partial(_measure_activations, tool, states)
        yield (
            "passive forces",
            partial(measure_passive_forces, tool, _find_result(tool, "_states.sto")),
        )


def _plan_static_optimization(
    tool: TrialTool, tools: Sequence[TrialTool], claimed: set[Path]
) -> Iterator[PlannedMeasurement]:
    """Yield the measurements of results of StaticOptimization.

    Args:
        tool: setup whose results are measured.
        tools: setups of all tools of the trial.
        claimed: set to which the measured files are added.
    """
    for analysis in tool.setup.analysis_set.objects:
        if type(analysis).__name__ != "StaticOptimization" or not analysis.on:
            continue
        for ending in ("force", "activation"):
            file = _find_result(tool, f"_{analysis.name}_{ending}.sto")
            if file is None:
                missing_error = MissingInput(
                    f"'{tool.setup.name}_{analysis.name}_{ending}.sto' of {tool} is missing; run this setup"
                )
                yield (
                    ("residuals and reserves" if ending == "force" else "activations"),
                    partial(_raise_missing, missing_error),
                )
                continue
            claimed.add(file)
            if ending == "force":
                yield "residuals", partial(_measure_residuals, tool, file)
                yield "reserves", partial(_measure_reserves, tool, file, tools)
            else:
                yield "activations", partial(_measure_activations, tool, file)
        # StaticOptimization writes no states of fibers.
        yield "passive forces", partial(measure_passive_forces, tool, None)


def _measure_residuals(tool: TrialTool, file: Path) -> Numbers:
    """Return an iterator over the residuals of a tool.

    Raises:
        MissingInput: the table has no residual actuators.
    """
    units = find_actuators(tool).residuals
    if not any(column in units for column in tool.folder.read_table(file).columns):
        raise MissingInput(f"{tool} has no residual actuators")
    return measure_residuals(tool.folder, file, units, compute_scale(tool), TOOL_NAMES[tool.tag])


def _measure_reserves(tool: TrialTool, file: Path, tools: Sequence[TrialTool]) -> Numbers:
    """Return an iterator over the reserves of a tool."""
    return measure_reserves(tool, file, find_actuators(tool), tools)


def _measure_activations(tool: TrialTool, file: Path) -> Numbers:
    """Return an iterator over the activations of a tool."""
    return measure_activations(tool.folder, file, find_actuators(tool).muscles)


def _plan_results_without_setup(
    folder: TrialFolder, claimed: set[Path]
) -> Iterator[PlannedMeasurement]:
    """Yield the measurements of results without a setup, by their names and labels."""
    present_classes = {tool.tag for tool in folder.tools}
    # With a setup, its own results are measured already.
    if not present_classes & {"RRATool", "CMCTool"}:
        for file in folder.find_files("_Actuation_force.sto", "_StaticOptimization_force.sto"):
            if file not in claimed:
                units = find_actuators(None).residuals
                yield (
                    "residuals",
                    partial(measure_residuals, folder, file, units, LoadScale(), f"'{file.name}'"),
                )
        for file in folder.find_files("_pErr.sto"):
            yield "errors of tracking", partial(measure_tracking_errors, folder, file, None)
    if "InverseKinematicsTool" not in present_classes:
        for file in folder.find_files("_ik_marker_errors.sto"):
            yield "errors of markers", partial(measure_written_errors, folder, file)
    missing_classes = [tool_class for tool_class in SETUPS if tool_class not in present_classes]
    if missing_classes:
        yield (
            f"results of {join_words(missing_classes)}",
            partial(_raise_missing, MissingInput("the trial has no such setup")),
        )
