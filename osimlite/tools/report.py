"""Report of trials on one HTML page: motion, angles, moments, residuals and errors of the fit."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.files import write_atomically
from osimlite.base.records import replace
from osimlite.base.text import join_words
from osimlite.errors import OsimliteError
from osimlite.fitting.fitted_motion import MARKER_ERROR_LIMITS_M
from osimlite.io.document.cache import get_object
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.tools.evidence import Evidence
from osimlite.tools.outcome import Outcome
from osimlite.tools.trial_curves import (
    TrialCurve,
    TrialOutcomes,
    collect_actuators,
    collect_angles,
    collect_contacts,
    collect_controls,
    collect_moments,
    collect_trials,
    create_recording,
    find_root_names,
    read_muscle_states,
    select_dynamics_tables,
)
from osimlite.tools.trials.check import check_trial
from osimlite.tools.trials.folder import SETUPS
from osimlite.view.lettering import plain_lettering
from osimlite.view.model_view import ModelView
from osimlite.view.page import page_data, page_text
from osimlite.view.panel_groups import Panel
from osimlite.view.panels import COLORS, draw_pages, has_cycles, make_figure
from osimlite.view.recording import MeasuredMarkers

SIDES = {"r": (COLORS[0], "right"), "l": (COLORS[1], "left"), "": ("#444444", "")}
"""Color and name of the curves of each side."""
PERCENT = np.linspace(0.0, 100.0, 101)
"""Points of the gait cycle at which curves are drawn, %."""
MAX_NAMED_MARKERS = 12
"""Number of markers whose errors are shown by name."""
STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #1d2733; background: #fff; max-width: 1120px; margin: 0 auto;
  padding: 0 20px 60px }
h1 { font-size: 26px; margin: 28px 0 4px }
h2 { font-size: 19px; margin: 34px 0 6px; border-bottom: 1px solid #d7dde5; padding-bottom: 4px }
p.note { color: #5a6675; margin: 4px 0 10px }
table { border-collapse: collapse; margin: 8px 0 }
td, th { padding: 2px 18px 2px 0; text-align: left; vertical-align: top }
iframe { width: 100%; height: 600px; border: 1px solid #d7dde5; border-radius: 6px }
td.number, .good, .okay, .bad { white-space: nowrap }
td { overflow-wrap: anywhere }
.source { color: #5a6675; font-size: 13px }
td.source { overflow-wrap: break-word }
.good { color: #1a7f37 } .okay { color: #9a6700 } .bad { color: #cf222e; font-weight: 600 }
ul.note { color: #5a6675; margin: 0 0 10px; padding-left: 20px; overflow-wrap: anywhere }
img { max-width: 100%; height: auto; display: block }
"""
"""Style sheet of the page."""


NO_SIDEBAR_STYLE = "body{grid-template-columns:1fr!important}aside{display:none!important}"
"""Style that hides the lists at the sides of the viewer."""


def report(outcomes: Mapping[str | Path, Outcome], path: str | Path) -> Path:
    """Write a report of runs as one HTML page that needs no other file.

    The setups of one folder are one trial, named after the folder; a single Moco study is named
    after itself. Trials, and the left and the right side, are drawn over each other. With measured
    loads, curves cover the gait cycle, from each strike of a foot to its next.

    Args:
        outcomes: outcomes by their setups.
        path: file to write.

    Returns:
        Path of the file.

    Raises:
        OsimliteError: no outcome has a motion, or the file cannot be written.
        MissingDependency: matplotlib is not installed.
    """
    trials = collect_trials(outcomes)
    if all(trial.evidence is None for trial in trials):
        raise OsimliteError("nothing to report: no setup has a motion")
    with plain_lettering():
        sections = "".join([*_render_trials(trials), *_render_verdicts(outcomes)])
    title = html.escape(join_words([trial.name for trial in trials]))
    page = (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport" '
        f'content="width=device-width, initial-scale=1"><title>{title}</title>'
        f"<style>{STYLE}</style></head><body><h1>{title}</h1>{sections}</body></html>\n"
    )
    write_atomically(path, page)
    return Path(path)


def _render_trials(trials: Sequence[TrialOutcomes]) -> Iterator[str]:
    """Yield the HTML of messages, viewers and figures of all trials."""
    for trial in trials:
        facts = "".join(_render_messages(trial))
        heading = f"<h2>{html.escape(trial.name)}</h2>" if len(trials) > 1 else ""
        yield f"{heading}<table>{facts}</table>"
        if trial.evidence is not None:
            yield _render_viewer(trial.evidence, read_muscle_states(trial))
    moving_trials = [trial for trial in trials if trial.evidence is not None]
    yield from _render_section("Joint angles", collect_angles(moving_trials))
    yield from _render_section("Joint moments", collect_moments(moving_trials))
    for title, note, panels in collect_actuators(moving_trials):
        yield from _render_panels(title, note, panels)
    yield from _render_section("Controls", collect_controls(moving_trials))
    yield from _render_section("Contact forces", collect_contacts(moving_trials))
    for trial in moving_trials:
        name = f": {trial.name}" if len(moving_trials) > 1 else ""
        yield from _render_residuals(trial, name)
        yield from _render_errors(trial, name)


def _render_messages(trial: TrialOutcomes) -> Iterator[str]:
    """Yield the rows of the messages of a trial, with the tool and the setup that made them."""
    for index, outcome in enumerate(trial.outcomes):
        tool = ""
        if index < len(trial.setups):
            setup = trial.setups[index]
            tool = f"{type(get_object(str(setup))).__name__}, {setup.name}"
        source = html.escape(tool)
        for name, message in outcome.messages:
            yield (
                f'<tr><td class="source">{source}</td><th>{html.escape(name)}</th>'
                f"<td>{html.escape(message)}</td></tr>"
            )


def _render_verdicts(outcomes: Mapping[str | Path, Outcome]) -> Iterator[str]:
    """Yield the HTML of the results' quality by published limits."""
    result_files = [file for outcome in outcomes.values() for file in outcome.files]
    setups = [setup for setup in outcomes if type(get_object(str(setup))).__name__ in SETUPS]
    try:
        result = check_trial(*setups, written=result_files) if setups else None
    # A trial without checkable results has no verdicts, but it has a report.
    except OsimliteError:
        return
    if result is None or not result.verdicts:
        return
    rows = "".join(
        f'<tr><td class="{verdict.verdict}">{verdict.verdict}</td><td '
        f'class="number">{html.escape(verdict.value_text)}</td>'
        f'<td class="number">{verdict.limits}</td><td>{html.escape(verdict.words)} '
        f'<span class="source">{html.escape(verdict.source)}</span></td></tr>'
        for verdict in result.worst
    )
    unchecked = "".join(f"<li>{html.escape(reason)}</li>" for reason in result.unchecked)
    unchecked = (
        f'<p class="note">Not checked:</p><ul class="note">{unchecked}</ul>' if unchecked else ""
    )
    yield (
        '<h2>Is it good enough?</h2><p class="note">The worst value of each quantity. Good: within '
        "every published limit; okay: "
        "within the looser of two limits only; bad: beyond "
        "all. Limits: up to the first number a value is good, up to the second it is okay.</p>"
        "<table><tr><th>result</th><th>value</th><th>limits</th><th>quantity</th></tr>"
        f"{rows}</table>{unchecked}"
    )


def _render_panels(title: str, note: str, panels: Sequence[Panel]) -> Iterator[str]:
    """Yield the HTML of pages of panels."""
    axis_note = "Over the gait cycle." if has_cycles(panels) else "Over time."
    pictures = "".join(_render_image(figure) for figure in draw_pages("", panels))
    yield f'<h2>{title}</h2><p class="note">{axis_note} {note}</p>{pictures}'


def _render_viewer(evidence: Evidence, states: Mapping[str, Array]) -> str:
    """Return the HTML of a viewer with the motion.

    Args:
        evidence: motion of a run, with measured data.
        states: activations that a tool has computed, which color the muscles.
    """
    mechanism = build_mechanism(evidence.model)
    measured = None
    if evidence.measured is not None:
        stations_by_name = {
            path.rpartition("/")[2]: station for path, station in mechanism.stations.items()
        }
        mapped_indices = [
            index for index, name in enumerate(evidence.markers) if name in stations_by_name
        ]
        names = [evidence.markers[index] for index in mapped_indices]
        stations = [
            (stations_by_name[name].body, np.asarray(stations_by_name[name].location))
            for name in names
        ]
        measured = MeasuredMarkers(names, stations, evidence.measured[:, mapped_indices])
    motion = create_recording(
        replace(evidence, states={**evidence.states, **states}), mechanism, measured
    )
    viewer = ModelView.from_model(evidence.model, mechanism, file=evidence.file, motion=motion)
    # A report shows no findings about the model.
    data = page_data(viewer.model, viewer.scene, viewer.motion, (), viewer.q)
    page = page_text(data).replace("</style>", f"{NO_SIDEBAR_STYLE}</style>", 1)
    note = "Green: measured markers; pink: markers of the model." if measured else ""
    return f'<iframe srcdoc="{html.escape(page)}" title="the motion"></iframe><p class="note">{note}</p>'


def _render_section(title: str, panels: Mapping[str, list[TrialCurve]]) -> Iterator[str]:
    """Yield the HTML of a figure with one panel for each quantity."""
    if not panels:
        return
    lines = [line for group in panels.values() for line in group]
    # The panels of a section share their axis, so that one curve without cycles puts all of them
    # over time.
    cyclic = all(
        line.steps.get(side) and line.steps[side].cycles
        for line in lines
        for side in (line.side or "r",)
    )
    columns = 3
    rows = -(-len(panels) // 3)
    figure = make_figure("", (11.0, 0.4 + 2.1 * rows))
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for panel, (label, group) in zip(axes, panels.items(), strict=False):
        for line in group:
            _draw_curve(panel, line, cyclic=cyclic)
        panel.set_title(label.replace("_", " "), fontsize=10, loc="left")
        _style_axes(panel, "gait cycle (%)" if cyclic else "time (s)")
    for panel in axes[len(panels) :]:
        panel.set_visible(False)
    _add_legend(figure, lines)
    if cyclic:
        note = (
            "Over the gait cycle, from each strike of the foot on the same side to the next. Thin lines: each "
            "cycle; thick lines: mean."
        )
        if any(not line.side for line in lines):
            note += " For curves without a side, cycles begin with the right foot."
    else:
        note = "Over time"
        note += (
            "; vertical lines: strikes (solid) and toe-offs (dotted)."
            if any(line.steps for line in lines)
            else "."
        )
    yield f'<h2>{title}</h2><p class="note">{note}</p>{_render_image(figure)}'


def _draw_curve(panel: Any, line: TrialCurve, *, cyclic: bool) -> None:
    """Draw a curve over time, or each gait cycle and their mean."""
    color, _ = SIDES[line.side]
    if not cyclic:
        panel.plot(line.times, line.column, color=color, ls=line.style, lw=1.5)
        for side, steps in line.steps.items():
            if side == (line.side or side):
                for ls, moments in (("-", steps.strikes), (":", steps.offs)):
                    for moment in moments:
                        if line.times[0] <= moment <= line.times[-1]:
                            panel.axvline(moment, color=SIDES[side][0], ls=ls, lw=0.6, alpha=0.6)
        return
    cycles = [
        np.interp(first + (last - first) * PERCENT / 100.0, line.times, line.column)
        for first, last in line.steps[line.side or "r"].cycles
        # Loads may be measured before and after the motion, too.
        if line.times[0] <= first and last <= line.times[-1]
    ]
    for cycle in cycles:
        panel.plot(PERCENT, cycle, color=color, ls=line.style, lw=0.7, alpha=0.5)
    if cycles:
        panel.plot(PERCENT, np.mean(cycles, axis=0), color=color, ls=line.style, lw=2.0)


def _render_residuals(trial: TrialOutcomes, name: str) -> Iterator[str]:
    """Yield the HTML of figures of residual forces and moments."""
    for outcome in trial.outcomes:
        root = find_root_names(outcome.evidence)
        for table in select_dynamics_tables(outcome):
            labels_by_unit = {
                unit: [
                    label
                    for label in table.columns
                    if label.endswith(ending) and label[: -len(ending)] in root
                ]
                for ending, unit in (("_force", "force (N)"), ("_moment", "moment (N m)"))
            }
            if not any(labels_by_unit.values()):
                continue
            figure = make_figure("", (11.0, 3.0))
            for panel, (unit, labels) in zip(
                figure.subplots(1, 2), labels_by_unit.items(), strict=True
            ):
                for color, label in zip(COLORS, labels, strict=False):
                    panel.plot(
                        table.times,
                        table[label],
                        color=color,
                        lw=1.4,
                        label=label.rpartition("_")[0],
                    )
                panel.set_ylabel(unit)
                panel.legend(frameon=False, fontsize=8)
                _style_axes(panel, "time (s)")
            note = "Residual forces at the joint to ground; ideally zero."
            yield f'<h2>Residuals{html.escape(name)}</h2><p class="note">{note}</p>{_render_image(figure)}'


def _render_errors(trial: TrialOutcomes, name: str) -> Iterator[str]:
    """Yield the HTML of figures of marker and sensor errors."""
    evidence = trial.evidence
    if evidence is None:
        return
    if evidence.measured is not None and evidence.positions is not None and evidence.markers:
        errors = 100.0 * np.linalg.norm(evidence.positions - evidence.measured, axis=2)
        figure = _draw_errors(
            evidence.times,
            evidence.markers,
            errors,
            "marker",
            "cm",
            [100.0 * end for end in MARKER_ERROR_LIMITS_M],
        )
        note = "Dashed: OpenSim's limits, 2 cm for the root mean square and 4 cm for the largest error."
        yield f'<h2>Marker errors{html.escape(name)}</h2><p class="note">{note}</p>{_render_image(figure)}'
    if evidence.angles is not None and evidence.sensors:
        figure = _draw_errors(
            evidence.times, evidence.sensors, np.degrees(evidence.angles), "sensor", "deg", ()
        )
        note = "Angles between measured and model orientations."
        yield f'<h2>Sensor errors{html.escape(name)}</h2><p class="note">{note}</p>{_render_image(figure)}'


def _draw_errors(
    times: Array, names: Sequence[str], errors: Array, noun: str, unit: str, limits: Sequence[float]
) -> Any:
    """Draw errors over time, and the worst markers or sensors by name.

    Args:
        times: times (t,), s.
        names: names of m markers or sensors.
        errors: errors (t, m); NaN where one was not measured.
        noun: noun for the names in the singular, for example "marker".
        unit: unit of the errors.
        limits: limits of the root mean square and of the largest error.

    Returns:
        Figure of matplotlib.
    """
    is_measured = np.isfinite(errors)
    measured_errors = np.where(is_measured, errors, 0.0)
    # A frame without any measured marker divides by 1, not by 0.
    rms = np.sqrt((measured_errors**2).sum(axis=1) / np.maximum(is_measured.sum(axis=1), 1))
    figure = make_figure("", (11.0, 3.4))
    time_axes, name_axes = figure.subplots(1, 2, width_ratios=(2, 1))
    time_axes.plot(times, rms, color=COLORS[0], lw=1.6, label="root mean square")
    time_axes.plot(times, measured_errors.max(axis=1), color=COLORS[1], lw=1.2, label="largest")
    for limit, color in zip(limits, COLORS, strict=False):
        time_axes.axhline(limit, color=color, lw=0.8, ls="--")
    time_axes.set_ylabel(f"{noun} error ({unit})")
    time_axes.set_ylim(bottom=0.0)
    time_axes.legend(frameon=False, fontsize=8)
    _style_axes(time_axes, "time (s)")
    rms_by_name = np.sqrt((measured_errors**2).sum(axis=0) / np.maximum(is_measured.sum(axis=0), 1))
    worst_indices = np.argsort(-rms_by_name)[:MAX_NAMED_MARKERS][::-1]
    name_axes.barh(
        [names[index] for index in worst_indices],
        rms_by_name[worst_indices],
        color=COLORS[0],
        height=0.7,
    )
    name_axes.tick_params(axis="y", labelsize=8)
    name_axes.set_title(f"worst {noun}s", fontsize=10, loc="left")
    _style_axes(name_axes, f"root mean square ({unit})")
    return figure


def _add_legend(figure: Any, lines: Sequence[TrialCurve]) -> None:
    """Add a legend of sides and trials to a figure."""
    # matplotlib is optional, so that this module can be imported without it.
    from matplotlib.lines import Line2D

    side_handles = [
        Line2D([], [], color=color, label=name)
        for side, (color, name) in SIDES.items()
        if name and any(line.side == side for line in lines)
    ]
    trials = dict.fromkeys((line.label, line.style) for line in lines)
    styles = (
        [Line2D([], [], color="#444444", ls=ls, label=label) for label, ls in trials]
        if len(trials) > 1
        else []
    )
    if side_handles or styles:
        figure.legend(
            handles=[*side_handles, *styles],
            loc="outside upper right",
            ncols=6,
            frameon=False,
            fontsize=9,
        )


def _style_axes(panel: Any, label: str) -> None:
    """Set grid, ticks and label of a panel."""
    panel.grid(True, color="0.92", lw=0.8)
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)
    panel.tick_params(labelsize=8)
    panel.margins(x=0.0)
    panel.set_xlabel(label, fontsize=8)


def _render_image(figure: Any) -> str:
    """Return the HTML of a figure as an embedded image."""
    stream = io.BytesIO()
    # Vector graphics remain sharp when the page is enlarged or printed.
    figure.savefig(stream, format="svg")
    return f'<img alt="" src="data:image/svg+xml;base64,{base64.b64encode(stream.getvalue()).decode()}">'
