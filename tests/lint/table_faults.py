"""Random faults in tables: headers, labels, rows and times."""

from __future__ import annotations

import random
import re
from collections.abc import Callable

from tests.lint.projects import NUMBER, Change, Project, Table, misspelt


def _table(project: Project, draw: random.Random) -> Table:
    return project.tables[draw.choice(sorted(project.tables))]


def _head_lines(table: Table) -> tuple[int, ...]:
    return tuple(range(1, table.label_line + 2))


def header_key(project: Project, draw: random.Random) -> Change | None:
    """Misspell or remove a key of the header."""
    table = _table(project, draw)
    if table.is_markers:
        keys = table.cells(1)
        at = draw.randrange(len(keys))
        new = draw.choice(
            (keys[:at] + keys[at + 1 :], [*keys[:at], misspelt(draw, keys[at]), *keys[at + 1 :]])
        )
        return Change(
            table.name, f"header: {keys[at]}", table.with_cells(1, new), (1, 2, 3), sure=new != keys
        )
    at = draw.choice(
        [k for k in range(table.label_line) if re.match(r"(\w+=|endheader)", table.lines[k])]
    )
    key = table.lines[at].split("=")[0]
    new_key = draw.choice(("", misspelt(draw, key), misspelt(draw, key)))
    new_lines = [table.lines[at].replace(key, new_key, 1)] if new_key else []
    sure = key in ("endheader", *_counts(table))
    return Change(
        table.name,
        f"{key} -> {new_key}",
        table.with_lines(at, *new_lines),
        _head_lines(table),
        sure=sure,
    )


def _counts(table: Table) -> tuple[str, ...]:
    return ("nRows", "nColumns") if table.old else ()


def header_value(project: Project, draw: random.Random) -> Change | None:
    table = _table(project, draw)
    if table.is_markers:
        values = table.cells(2)
        at = draw.randrange(len(values))
        key = table.cells(1)[at]
        new = draw.choice(("", "abc", "0", "-1", "1.5", "m", "cm", "inches", "7", "1e9"))
        text = table.with_cells(2, [*values[:at], new, *values[at + 1 :]])
        sure = new != values[at] and key in ("NumMarkers", "NumFrames", "Units")
        return Change(table.name, f"{key}: {values[at]} -> {new}", text, (2, 3), sure=sure)
    at = draw.choice([k for k in range(table.label_line) if re.match(r"\w+=", table.lines[k])])
    key, _, value = table.lines[at].partition("=")
    numbers = (
        ("", "abc", "0", "-1", str(int(value) - 1), str(int(value) + 1))
        if value.isdecimal()
        else ()
    )
    # Exchanging yes and no makes another valid project, see `other_units`.
    units = ("no", "yes", "YES") if key != "inDegrees" else ()
    new = draw.choice((*numbers, *units, "", "true", "double", "Vec3", "1 2"))
    text = table.with_lines(at, f"{key}={new}")
    return Change(
        table.name,
        f"{key}: {value!r} -> {new!r}",
        text,
        _head_lines(table),
        sure=key in _counts(table),
    )


def _used_labels(project: Project, table: Table) -> list[int]:
    """Return the indices of the columns that a setup uses."""
    components = set() if table.is_markers else set(project.components)
    return [
        k
        for k, label in enumerate(table.labels)
        if k > table.time
        and label
        and (label in components or any(map(project.places_of, {label, label[:-1]} - {""})))
    ]


def label(project: Project, draw: random.Random) -> Change | None:
    table = _table(project, draw)
    used = _used_labels(project, table)
    if not used:
        return None
    at = draw.choice([table.time, *used, *used, *used])
    old = table.labels[at]
    others = [other for other in table.labels[table.time + 1 :] if other and other != old]
    new = draw.choice(
        (misspelt(draw, old), misspelt(draw, old), draw.choice(others), old.upper(), f"/{old}", f"{old[:1]} {old[1:]}",
         "", f"{old}/value")
    )  # fmt: skip
    text = table.with_cells(table.label_line, [*table.labels[:at], new, *table.labels[at + 1 :]])
    # If a setup uses only the beginning of a label, a change of its last letter may be no fault.
    asked = old if project.places_of(old) or old in project.components else old[:-1]
    is_known = (new in project.names and new not in others) or new.startswith(asked)
    return Change(
        table.name, f"label {old!r} -> {new!r}", text, (table.label_line + 1, table.label_line + 2), (old, old[:-1]),
        sure=new != old and not is_known and at != table.time,
    )  # fmt: skip


def _columns(table: Table, change: Callable[[list[str]], list[str]]) -> str:
    lines = [
        "\t".join(change(line.split("\t"))) if k in (table.label_line, *table.rows) else line
        for k, line in enumerate(table.lines)
    ]
    return "\n".join(lines)


def column_gone(project: Project, draw: random.Random) -> Change | None:
    table = _table(project, draw)
    if table.is_markers or not (used := _used_labels(project, table)):
        return None
    at = draw.choice(used)
    old = table.labels[at]
    text = _columns(table, lambda cells: cells[:at] + cells[at + 1 :])
    text = text.replace(f"nColumns={len(table.labels)}", f"nColumns={len(table.labels) - 1}")
    # A Moco study may track fewer columns.
    return Change(
        table.name,
        f"no column {old!r}",
        text,
        (table.label_line + 1,),
        (old, old[:-1]),
        sure=table.old,
    )


def columns_swapped(project: Project, draw: random.Random) -> Change | None:
    table = _table(project, draw)
    used = _used_labels(project, table)
    if len(used) < 2:
        return None
    one, other = draw.sample(used, 2)
    labels = list(table.labels)
    labels[one], labels[other] = labels[other], labels[one]
    text = table.with_cells(table.label_line, labels)
    what = f"labels {labels[one]!r} and {labels[other]!r} swapped"
    words = (labels[one], labels[one][:-1], labels[other], labels[other][:-1])
    return Change(table.name, what, text, (table.label_line + 1,), words)


def cell(project: Project, draw: random.Random) -> Change | None:
    table = _table(project, draw)
    line = draw.choice(table.rows)
    cells = table.cells(line)
    at = draw.randrange(table.time + 1, len(cells))
    new = draw.choice(("NaN", "abc", "", "1,5", "--", "#N/A", "1.2.3", "1e", "1 2", "inf"))
    change = Change(
        table.name,
        f"{cells[at]} -> {new!r}",
        table.with_cells(line, [*cells[:at], new, *cells[at + 1 :]]),
        (line + 1,),
    )
    return change._replace(sure=cells[at] != "" and (table.old or table.is_markers))


def row(project: Project, draw: random.Random) -> Change | None:
    table = _table(project, draw)
    at = draw.choice(table.rows[2:-2])
    line = table.lines[at]
    cells = table.cells(at)
    what, new, sure = draw.choice(
        (
            ("short", ["\t".join(cells[:-1])], True),
            ("long", [line + "\t1.0"], True),
            ("twice", [line, line], True),
            ("gone", [], True),
            ("a blank line before", ["", line], not table.old),
            ("a remark before", ["# remark", line], True),
            ("swapped", [table.lines[at + 1], line], True),
            ("commas", [line.replace("\t", ",")], True),
            ("decimal commas", [line.replace(".", ",")], True),
        )
    )  # fmt: skip
    text = table.with_lines(at, *new, instead_of=2 if what == "swapped" else 1)
    lines = (at, at + 1, at + 2, *(() if what != "gone" else _head_lines(table)))
    return Change(table.name, f"row {what}", text, lines, sure=sure)


def time(project: Project, draw: random.Random) -> Change | None:
    table = _table(project, draw)
    place = draw.randrange(2, len(table.rows) - 2)
    at = table.rows[place]
    cells = table.cells(at)
    before = table.cells(table.rows[place - 1])[table.time]
    new = draw.choice(
        (
            before,
            "NaN",
            "abc",
            "",
            "0.0",
            "-1",
            "1000",
            cells[table.time] + "x",
            f"{float(before) - 0.1:.4f}",
        )
    )
    cells[table.time] = new
    return Change(
        table.name, f"time {new!r}", table.with_cells(at, cells), (at + 1, at + 2), sure=True
    )


def cut_off(project: Project, draw: random.Random) -> Change | None:
    """Cut off the end of a file."""
    name = draw.choice(sorted({*project.tables, *project.documents}))
    text = project.texts[name]
    kept = text[: draw.randrange(len(text) // 20, len(text) - 5)]
    return Change(
        name,
        f"{len(kept)} of {len(text)} letters",
        kept,
        tuple(range(1, kept.count("\n") + 2)),
        words=("time_range", "initial_time", "final_time") if name in project.tables else (),
        sure=name in project.documents,
    )


def other_units(project: Project, draw: random.Random) -> Change | None:
    """Convert all numbers of a table except for times to other units, or change only the stated unit."""
    table = _table(project, draw)
    lines, labels = tuple(range(1, len(table.lines) + 1)), table.labels[1:]
    words = tuple(filter(None, (*labels, *(label[:-1] for label in labels))))
    units = {"inDegrees=yes": "inDegrees=no", "inDegrees=no": "inDegrees=yes"}
    given = next((k for k, line in enumerate(table.lines) if line in units), None)
    if given is not None and draw.random() < 0.3:
        new = units[table.lines[given]]
        return Change(table.name, new, table.with_lines(given, new), lines, words)
    factor = draw.choice((1000.0, 0.001, 0.0174532925, 57.2957795))
    kept = table.time + 1

    def scaled(cells: list[str]) -> list[str]:
        numeric = NUMBER.fullmatch(cells[0].strip()) is not None
        return cells[:kept] + [
            f"{float(c) * factor:.9g}" if numeric and NUMBER.fullmatch(c) else c
            for c in cells[kept:]
        ]

    return Change(table.name, f"numbers times {factor:g}", _columns(table, scaled), lines, words)
