"""Draw the packages of osimlite and their imports into `docs/images/architecture.svg`.

    python docs/_architecture.py

``python packaging/regenerate.py`` does this with all other generated files. A package of the top
level is called a room. A row has the rooms whose longest chain of imports has the same length. An
arrow leads from a room to one that it imports. Arrows that follow from others are omitted: if a
imports b and b imports c, the arrow from a to c is.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from html import escape
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from grimp import ImportGraph, build_graph

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / "docs" / "images" / "architecture.svg"

SUMMARIES = {
    "base": "text, files, records, options",
    "schema": "OpenSim's classes",
    "mechanics": "laws, mechanism, arithmetic",
    "io": "XML, tables, meshes",
    "simulation": "forces, engines, trajectories",
    "lint": "rules and reports",
    "translate": "URDF, MJCF, glTF, HTML",
    "fitting": "markers, scaling, ModOps",
    "derivatives": "CasADi, tangents",
    "view": "pages, plots, films",
    "optimal": "Moco's studies",
    "models": "built-in models",
    "tools": "OpenSim's setup files",
    "studies": "sweeps, gaits, learning",
    "cli": "commands, language server",
}
"""Summary of each room, which is drawn below its name."""

OTHER_MODULES = {"__main__", "errors", "gym", "mjcf", "moco"}
"""Modules of the top level that are no rooms: errors and public names."""

BOX_WIDTH = 206
BOX_HEIGHT = 62
COLUMN_WIDTH = 230
"""Distance of the centres of two boxes in a row."""
ROW_HEIGHT = 104
"""Distance of the centres of two rows."""
MARGIN = 24

# After four sweeps nothing changes any more.
SWEEPS = 8
"""Number of times that the rows are sorted by the mean columns of their neighbours."""

Arrows = frozenset[tuple[str, str]]


class Item(NamedTuple):
    """Item of a row: the box of a room, or the bend of an arrow that passes the row."""

    room: str
    """Name of the room; empty for a bend."""
    arrow: tuple[str, str] = ("", "")
    """Source with the level of the row, and target of the arrow that bends."""


def find_rooms(graph: ImportGraph) -> list[str]:
    """Return the names of the rooms, from top to bottom of the `layers` contract of pyproject.toml.

    Raises:
        ValueError: `SUMMARIES` lacks a room, or has one that does not exist.
    """
    with (ROOT / "pyproject.toml").open("rb") as file:
        contracts = tomllib.load(file)["tool"]["importlinter"]["contracts"]
    # There is one contract of this type.
    (layers,) = (contract["layers"] for contract in contracts if contract["type"] == "layers")
    names = [word.strip("() ") for layer in layers for word in layer.replace("|", ":").split(":")]
    rooms = [
        name for name in names if f"osimlite.{name}" in graph.modules and name not in OTHER_MODULES
    ]
    if {*rooms} != {*SUMMARIES}:
        raise ValueError(
            "SUMMARIES of docs/_architecture.py differs from the rooms: "
            f"{sorted({*rooms} ^ {*SUMMARIES})}"
        )
    return rooms


def find_arrows(graph: ImportGraph, rooms: list[str]) -> Arrows:
    """Return the imports between rooms that do not follow from others.

    Args:
        graph: graph of all imports.
        rooms: names of the rooms, importing ones first.

    Returns:
        Pairs of the importing and the imported room.
    """
    imports: dict[str, set[str]] = {room: set() for room in rooms}
    for module in graph.modules:
        for imported in graph.find_modules_directly_imported_by(module):
            # The second part of a name such as `osimlite.io.tables` is the room.
            importer, target = (f"{name}.".split(".")[1] for name in (module, imported))
            if importer != target and importer in imports and target in imports:
                imports[importer].add(target)
    reached: dict[str, set[str]] = {}
    # The contract puts every room before those that it may import.
    for room in reversed(rooms):
        reached[room] = imports[room].union(*(reached[target] for target in imports[room]))
    return frozenset(
        (room, target)
        for room in rooms
        for target in imports[room]
        if not any(target in reached[other] for other in imports[room])
    )


def find_levels(rooms: list[str], arrows: Arrows) -> dict[str, int]:
    """Compute the length of the longest chain of imports from each room.

    Args:
        rooms: names of the rooms, importing ones first.
        arrows: imports between them.

    Returns:
        Lengths by room; 0 for rooms that import no other.
    """
    levels: dict[str, int] = {}
    for room in reversed(rooms):
        levels[room] = 1 + max(
            (levels[target] for source, target in arrows if source == room), default=-1
        )
    return levels


def arrange_rows(rooms: list[str], arrows: Arrows, levels: Mapping[str, int]) -> list[list[Item]]:
    """Return the rows from top to bottom, each in an order in which few arrows cross.

    The method is that of Sugiyama et al. 1981: sort each row by the mean column of the neighbours.

    Args:
        rooms: names of the rooms.
        arrows: imports between them.
        levels: level of each room, which determines its row.
    """
    top = max(levels.values())
    rows: list[list[Item]] = [
        [Item(room) for room in rooms if levels[room] == top - row] for row in range(top + 1)
    ]
    links: dict[Item, list[Item]] = {Item(room): [] for room in rooms}
    for arrow in sorted(arrows):
        source, target = arrow
        chain = [Item(source)]
        for level in range(levels[source] - 1, levels[target], -1):
            # An arrow has a bend in each row that it passes; the level distinguishes these items.
            bend = Item("", (f"{source} {level}", target))
            rows[top - level].append(bend)
            chain.append(bend)
        for upper, lower in pairwise([*chain, Item(target)]):
            links.setdefault(upper, []).append(lower)
            links.setdefault(lower, []).append(upper)
    for sweep in range(SWEEPS):
        # Alternate directions, so that upper and lower neighbours both count.
        for row in rows if sweep % 2 == 0 else reversed(rows):
            columns = {
                item: column
                for each in rows
                for item, column in zip(each, compute_columns(len(each)), strict=True)
            }
            row.sort(
                key=lambda item: (
                    sum(columns[other] for other in links[item]) / max(1, len(links[item]))
                )
            )
    return rows


def compute_columns(count: int) -> list[float]:
    """Return the columns of the items of a row, centred about 0."""
    return [index - (count - 1) / 2 for index in range(count)]


def find_parts(graph: ImportGraph, room: str) -> str:
    """Return the names of the packages in a room, as they are drawn in its box."""
    inner = [name for name in graph.find_children(f"osimlite.{room}") if graph.find_children(name)]
    return ", ".join(sorted(name.rpartition(".")[2] for name in inner))


def draw_graph(graph: ImportGraph) -> str:
    """Return the picture of a graph of imports as SVG."""
    rooms = find_rooms(graph)
    arrows = find_arrows(graph, rooms)
    levels = find_levels(rooms, arrows)
    rows = arrange_rows(rooms, arrows, levels)
    width = round(2 * MARGIN + COLUMN_WIDTH * max(map(len, rows)))
    height = 2 * MARGIN + ROW_HEIGHT * (len(rows) - 1) + BOX_HEIGHT
    centres = {
        item: (width / 2 + COLUMN_WIDTH * column, MARGIN + ROW_HEIGHT * number + BOX_HEIGHT / 2)
        for number, row in enumerate(rows)
        for item, column in zip(row, compute_columns(len(row)), strict=True)
    }
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        'font-family="Helvetica, Arial, sans-serif" text-anchor="middle">',
        "<title>The rooms of osimlite, and what they import</title>",
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8" markerHeight="8" '
        'orient="auto"><path d="M0 0 8 4 0 8z" fill="#667"/></marker></defs>',
        f'<rect width="{width}" height="{height}" rx="8" fill="#fff"/>',
        *(draw_arrow(arrow, levels, centres) for arrow in sorted(arrows)),
        *(
            line
            for room in rooms
            for line in draw_box(room, find_parts(graph, room), centres[Item(room)])
        ),
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


def draw_arrow(
    arrow: tuple[str, str], levels: Mapping[str, int], centres: Mapping[Item, tuple[float, float]]
) -> str:
    """Return the SVG element of an arrow, which bends in the rows that it passes.

    Args:
        arrow: importing and imported room.
        levels: level of each room.
        centres: centre of each item (pixels).
    """
    source, target = arrow
    x, y = centres[Item(source)]
    y += BOX_HEIGHT / 2
    path = f"M{x:g} {y:g}"
    for level in range(levels[source] - 1, levels[target] - 1, -1):
        is_last = level == levels[target]
        item = Item(target) if is_last else Item("", (f"{source} {level}", target))
        new_x, middle = centres[item]
        new_y = middle - BOX_HEIGHT / 2
        half = (y + new_y) / 2
        path += f"C{x:g} {half:g} {new_x:g} {half:g} {new_x:g} {new_y:g}"
        x = new_x
        y = new_y
        if not is_last:
            # The arrow is vertical inside the row, so that it passes between the boxes.
            y = middle + BOX_HEIGHT / 2
            path += f"V{y:g}"
    return f'<path d="{path}" fill="none" stroke="#667" stroke-width="1.4" marker-end="url(#tip)"/>'


def draw_box(room: str, parts: str, centre: tuple[float, float]) -> Iterator[str]:
    """Draw the box of a room with its name, its summary and the packages inside.

    Args:
        room: name of the room.
        parts: names of the packages inside.
        centre: centre of the box (pixels).

    Yields:
        SVG elements.
    """
    x, y = centre
    left = x - BOX_WIDTH / 2
    top = y - BOX_HEIGHT / 2
    yield (
        f'<rect x="{left:g}" y="{top:g}" width="{BOX_WIDTH}" height="{BOX_HEIGHT}" rx="6" fill="#eef3fb" '
        'stroke="#38558c"/>'
    )
    yield f'<text x="{x:g}" y="{top + 20:g}" font-size="15" font-weight="bold" fill="#1c2c4c">{room}</text>'
    yield f'<text x="{x:g}" y="{top + 36:g}" font-size="11.5" fill="#223">{escape(SUMMARIES[room])}</text>'
    if parts:
        yield f'<text x="{x:g}" y="{top + 52:g}" font-size="10.5" font-style="italic" fill="#556">{parts}</text>'


def make_picture() -> str:
    """Return the picture of the packages of this clone as SVG."""
    return draw_graph(build_graph("osimlite", exclude_type_checking_imports=True, cache_dir=None))


if __name__ == "__main__":
    PICTURE.write_text(make_picture(), encoding="utf-8")
