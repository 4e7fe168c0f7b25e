"""HTML of models, motions, findings, paths and sweeps for Jupyter, with the embedded viewer.

The page is embedded as the text of an ``<iframe>``. It makes no network requests and may only run
its own scripts, so it also works in the sandboxed frames of VS Code and Colab. Each class names its
function of this module, see :func:`osimlite.base.lazy.make_notebook_repr`.
"""

from __future__ import annotations

import base64
import gzip
from collections.abc import Iterable, Sequence
from html import escape
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from osimlite.base.require import require
from osimlite.base.text import format_count, format_range, join_words
from osimlite.errors import OsimliteError

if TYPE_CHECKING:
    from osimlite.lint.diagnostic import Report
    from osimlite.schema.base import Component
    from osimlite.schema.model import Model
    from osimlite.simulation.muscle_curves import MuscleCurves
    from osimlite.simulation.paths import Paths
    from osimlite.simulation.trajectory import Trajectory
    from osimlite.studies.sweep.optimize import Optimum
    from osimlite.studies.sweep.run import Outcome

MAX_ROWS = 200
"""Largest number of rows of a table."""

MAX_COMPONENTS = 3000
"""Largest number of components of a tree."""

MAX_BYTES = 12_000_000
"""Largest size of an embedded page, compressed and in base64."""

FIRST_ROWS = 10
"""Number of rows of results that are shown."""

HEIGHT = 460
"""Height of the page, and largest height of a table, pixels."""

COLORS = {"error": "#d1242f", "warning": "#b97700", "info": "#5d6b7a"}

# The page decompresses itself in the frame: notebooks are smaller, and need no server.
_UNPACK = """<!doctype html><meta charset="utf-8"><script>
new Response(new Blob([Uint8Array.from(atob("@PAGE@"), (c) => c.charCodeAt(0))]).stream()
  .pipeThrough(new DecompressionStream("gzip"))).text()
  .then((text) => { document.open(); document.write(text); document.close(); });
</script>"""


def model(shown_model: Model) -> str:
    """Return the HTML of the component tree of a model and of its geometry."""
    tree = shown_model.tree()
    components = [component for component in tree.components if not tree.is_internal(component)]
    children: dict[int, list[Component]] = {}
    # The first component is the model itself.
    for component in components[1:MAX_COMPONENTS]:
        children.setdefault(id(tree.parent_of(component)), []).append(component)

    def branch(component: Component) -> str:
        heading = f"{escape(component.name)} <i>{escape(type(component).tag)}</i>"
        members = children.get(id(component), [])
        if not members:
            return f"<div style='margin-left:1.1em'>{heading}</div>"
        inner_html = "".join(map(branch, members))
        return f"<details style='margin-left:1.1em'><summary>{heading} ({len(members)})</summary>{inner_html}</details>"

    summary = f"<b>{escape(shown_model.name) or 'a model'}</b>: {format_count(len(components), 'component')}"
    inner_html = "".join(map(branch, children.get(id(shown_model), [])))
    hidden = _describe_hidden_rows(len(components), MAX_COMPONENTS)
    html = f"<details><summary>{summary}</summary>{inner_html}{hidden}</details>"
    return html + _embed_viewer(shown_model)


def trajectory(shown_trajectory: Trajectory) -> str:
    """Return a summary that opens to a table and, if the model is known, a player of the motion as HTML."""
    summary = f"<summary>{escape(shown_trajectory.heading)}</summary>"
    return f"<details>{summary}{shown_trajectory.format_html_table()}</details>" + (
        ""
        if shown_trajectory.model is None
        else _embed_viewer(shown_trajectory.model, shown_trajectory)
    )


def findings(report: Report) -> str:
    """Return the HTML of a table of findings, the worst first."""
    rows = sorted(report.findings, key=lambda finding: finding.severity.rank)
    severity_counts = (
        ("error", report.errors),
        ("warning", report.warnings),
        ("remark", report.infos),
    )
    counts = ", ".join(
        format_count(len(severity_findings), severity_name)
        for severity_name, severity_findings in severity_counts
    )
    cells = (
        [
            f"<b style='color:{COLORS[finding.severity]}'>{finding.severity}</b>",
            f"<span title='{escape(finding.name)}'>{finding.code}</span>",
            escape(finding.place),
            # Texts of models and findings may contain HTML.
            escape(finding.message),
            escape(finding.suggestion or ""),
        ]
        for finding in rows
    )
    heading = f"<div>{counts} in {format_count(report.count_files(), 'file')}</div>"
    return heading + (
        _make_table(("", "code", "place", "message", "suggestion"), cells, len(rows))
        if rows
        else ""
    )


def paths(model_paths: Paths) -> str:
    """Return an HTML table with length and moment arms of each path in the default pose."""
    lengths, arms = model_paths.lengths({}), model_paths.moment_arms({})
    cells = (
        [
            escape(name),
            f"{lengths[name]:.5g}",
            ", ".join(
                f"{escape(path.rpartition('/')[2])} {arm:.4g}" for path, arm in arms[name].items()
            ),
        ]
        for name in model_paths.names
    )
    return "<div>in the default pose</div>" + _make_table(
        ("path", "length (m)", "moment arms (m)"), cells, len(lengths)
    )


def muscle_curves(curves: MuscleCurves) -> str:
    """Return an HTML table of the least and greatest values of each muscle."""
    from osimlite.simulation.muscle_curves import QUANTITIES

    ranges = (
        map(format_range, *curves.get_bounds(name), [".4g"] * len(curves.muscles))
        for name in curves.columns
    )
    cells = zip(map(escape, curves.muscles), *ranges, strict=True)
    swept_note = f" over {escape(join_words(curves.coordinates))}" if curves.coordinates else ""
    heading = f"<div>{format_count(len(curves.muscles), 'muscle')} in {format_count(len(curves.poses), 'pose')}{swept_note}</div>"
    units = ((name, QUANTITIES.get(name, "m")) for name in curves.columns)
    headings = [escape(f"{name} ({unit})" if unit else name) for name, unit in units]
    return heading + _make_table(("muscle", *headings), cells, len(curves.muscles))


def runs(outcome: Outcome) -> str:
    """Return an HTML table of the first runs of a sweep."""
    table = outcome.to_arrow()
    rows = table.slice(0, FIRST_ROWS).to_pylist()
    cells = ([_format_number(value) for value in row.values()] for row in rows)
    heading = f"<div>{format_count(table.num_rows, 'run')} in <code>{escape(str(outcome.path))}</code></div>"
    return heading + _make_table(
        [escape(name) for name in table.column_names], cells, table.num_rows, FIRST_ROWS
    )


def optimum(best: Optimum) -> str:
    """Return the HTML of the best result of a search."""
    summary = f"{_format_number(best.value)} in evaluation {best.evaluation} of {best.evaluations} ({escape(best.ended)})"
    cells = ([escape(name), _format_number(value)] for name, value in best.values.items())
    return f"<div>best: {summary}</div>" + _make_table(
        ("variable", "value"), cells, len(best.values)
    )


def _embed_viewer(shown_model: Model, motion: Trajectory | None = None) -> str:
    """Return an iframe with the viewer, or a sentence with the reason why it is missing."""
    file = None if shown_model.layout is None else shown_model.layout.file
    folders = [] if file is None else [Path(file).parent, Path(file).parent / "Geometry"]
    try:
        require("numpy", extra="view", purpose="the picture")
        from osimlite.view.model_view import ModelView

        model_view = ModelView.from_model(
            shown_model, None if motion is None else motion.mechanism, folders, motion=motion
        )
        # mtime=0: equal pages give equal notebooks.
        encoded = base64.b64encode(
            gzip.compress(model_view.page_text().encode(), 6, mtime=0)
        ).decode()
    except OsimliteError as error:
        return f"<div>no picture: {escape(error.message)}</div>"
    # Notebooks with larger outputs become slow to open.
    if len(encoded) > MAX_BYTES:
        return (
            f"<div>a page of {len(encoded) / 1e6:.0f} MB is too large for a notebook; write it to a file: "
            "<code>osimlite.view.ModelView.from_model(model, motion=trajectory).write_page('page.html')</code></div>"
        )
    remarks = "".join(f"<div>{escape(remark)}</div>" for remark in model_view.remarks)
    return (
        # sandbox: the page may run its scripts only.
        f"<iframe srcdoc='{escape(_UNPACK.replace('@PAGE@', encoded))}' sandbox='allow-scripts' loading='lazy' "
        f"style='width:100%;height:{HEIGHT}px;border:1px solid #d9dfe6;border-radius:6px'></iframe>{remarks}"
    )


def _make_table(
    headings: Sequence[str], rows: Iterable[Sequence[str]], count: int, max_rows: int = MAX_ROWS
) -> str:
    """Return an HTML table of the first `max_rows` rows, followed by the number of omitted ones."""

    def line(tag: str, cells: Sequence[str]) -> str:
        return (
            "<tr>"
            + "".join(f"<{tag} style='text-align:left'>{cell}</{tag}>" for cell in cells)
            + "</tr>"
        )

    body = "".join(line("td", row) for row in islice(rows, max_rows))
    table = f"<table><thead>{line('th', headings)}</thead><tbody>{body}</tbody></table>"
    return f"<div style='max-height:{HEIGHT}px;overflow:auto'>{table}</div>{_describe_hidden_rows(count, max_rows)}"


def _describe_hidden_rows(count: int, max_rows: int) -> str:
    return f"<div>… and {count - max_rows} more</div>" if count > max_rows else ""


def _format_number(value: Any) -> str:
    return (
        f"{value:.6g}" if isinstance(value, float) else escape("" if value is None else str(value))
    )
