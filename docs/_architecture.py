"""The picture of the rooms and their imports, `docs/images/architecture.svg`, drawn from the imports themselves.

``python docs/_architecture.py`` writes it; ``python packaging/regenerate.py`` does so with all other generated files.
A row holds the rooms whose longest chain of imports has the same length. An arrow leads from a room to one that it
imports; arrows that follow from others (a imports b, b imports c, so a may import c) are left out.
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
"""What stands below the name of each room."""

LEFT_OUT = {"__main__", "errors", "gym", "mjcf", "moco"}
"""Modules of the top level that are no rooms: the errors, which all may import, and public names."""

BOX_WIDTH, BOX_HEIGHT = 206, 62
COLUMN_WIDTH, ROW_HEIGHT = 230, 104
MARGIN = 24
SWEEPS = 8
"""How often the rows are ordered by the means of their neighbours; after four nothing changes."""

Arrows = frozenset[tuple[str, str]]


class Item(NamedTuple):
    """A box, or the bend of an arrow where it passes a row between its ends (then `room` is empty)."""

    room: str
    arrow: tuple[str, str] = ("", "")


def find_rooms(graph: ImportGraph) -> list[str]:
    """Return the rooms from the top to the bottom of the `layers` contract of pyproject.toml.

    Raises:
        ValueError: `SUMMARIES` lacks a room, or has one that does not exist.
    """
    with (ROOT / "pyproject.toml").open("rb") as file:
        contracts = tomllib.load(file)["tool"]["importlinter"]["contracts"]
    (layers,) = (contract["layers"] for contract in contracts if contract["type"] == "layers")
    names = [word.strip("() ") for layer in layers for word in layer.replace("|", ":").split(":")]
    rooms = [name for name in names if f"osimlite.{name}" in graph.modules and name not in LEFT_OUT]
    if {*rooms} != {*SUMMARIES}:
        raise ValueError(
            f"SUMMARIES of docs/_architecture.py differs from the rooms: {sorted({*rooms} ^ {*SUMMARIES})}"
        )
    return rooms


def find_arrows(graph: ImportGraph, rooms: list[str]) -> Arrows:
    """Return the pairs of rooms of which the first imports the second, without those that follow from others."""
    imports: dict[str, set[str]] = {room: set() for room in rooms}
    for module in graph.modules:
        for imported in graph.find_modules_directly_imported_by(module):
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
    """Return for each room the length of its longest chain of imports."""
    levels: dict[str, int] = {}
    for room in reversed(rooms):
        levels[room] = 1 + max(
            (levels[target] for source, target in arrows if source == room), default=-1
        )
    return levels


def arrange(rooms: list[str], arrows: Arrows, levels: Mapping[str, int]) -> list[list[Item]]:
    """Return the rows from top to bottom, each in an order in which few arrows cross (method of Sugiyama 1981)."""
    top = max(levels.values())
    rows: list[list[Item]] = [
        [Item(room) for room in rooms if levels[room] == top - row] for row in range(top + 1)
    ]
    links: dict[Item, list[Item]] = {Item(room): [] for room in rooms}
    for arrow in sorted(arrows):
        source, target = arrow
        chain = [Item(source)]
        for level in range(levels[source] - 1, levels[target], -1):
            # One bend in each row: the level makes it another item than those of the other rows.
            bend = Item("", (f"{source} {level}", target))
            rows[top - level].append(bend)
            chain.append(bend)
        for upper, lower in pairwise([*chain, Item(target)]):
            links.setdefault(upper, []).append(lower)
            links.setdefault(lower, []).append(upper)
    for sweep in range(SWEEPS):
        for row in rows if sweep % 2 == 0 else reversed(rows):
            places = {
                item: place
                for each in rows
                for item, place in zip(each, place_columns(len(each)), strict=True)
            }
            row.sort(
                key=lambda item: (
                    sum(places[other] for other in links[item]) / max(1, len(links[item]))
                )
            )
    return rows


def place_columns(count: int) -> list[float]:
    """Return the columns of the items of a row, centred about 0."""
    return [place - (count - 1) / 2 for place in range(count)]


def find_parts(graph: ImportGraph, room: str) -> str:
    """Return the names of the packages inside a room, as they stand in its box."""
    inner = [name for name in graph.find_children(f"osimlite.{room}") if graph.find_children(name)]
    return ", ".join(sorted(name.rpartition(".")[2] for name in inner))


def draw(graph: ImportGraph) -> str:
    """Return the picture as SVG."""
    rooms = find_rooms(graph)
    arrows = find_arrows(graph, rooms)
    levels = find_levels(rooms, arrows)
    rows = arrange(rooms, arrows, levels)
    width = round(2 * MARGIN + COLUMN_WIDTH * max(map(len, rows)))
    height = 2 * MARGIN + ROW_HEIGHT * (len(rows) - 1) + BOX_HEIGHT
    centres = {
        item: (width / 2 + COLUMN_WIDTH * column, MARGIN + ROW_HEIGHT * number + BOX_HEIGHT / 2)
        for number, row in enumerate(rows)
        for item, column in zip(row, place_columns(len(row)), strict=True)
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
    """Return the element of an arrow, which bends in the rows that it passes."""
    source, target = arrow
    x, y = centres[Item(source)]
    y += BOX_HEIGHT / 2
    path = f"M{x:g} {y:g}"
    for level in range(levels[source] - 1, levels[target] - 1, -1):
        last = level == levels[target]
        new_x, middle = centres[Item(target) if last else Item("", (f"{source} {level}", target))]
        new_y = middle - BOX_HEIGHT / 2
        half = (y + new_y) / 2
        path += f"C{x:g} {half:g} {new_x:g} {half:g} {new_x:g} {new_y:g}"
        x, y = new_x, new_y
        if not last:
            y = middle + BOX_HEIGHT / 2
            path += f"V{y:g}"
    return f'<path d="{path}" fill="none" stroke="#667" stroke-width="1.4" marker-end="url(#tip)"/>'


def draw_box(room: str, parts: str, centre: tuple[float, float]) -> Iterator[str]:
    """Yield the elements of the box of a room: its name, what it is, the packages inside it."""
    x, y = centre
    left, top = x - BOX_WIDTH / 2, y - BOX_HEIGHT / 2
    yield (
        f'<rect x="{left:g}" y="{top:g}" width="{BOX_WIDTH}" height="{BOX_HEIGHT}" rx="6" fill="#eef3fb" '
        'stroke="#38558c"/>'
    )
    yield f'<text x="{x:g}" y="{top + 20:g}" font-size="15" font-weight="bold" fill="#1c2c4c">{room}</text>'
    yield f'<text x="{x:g}" y="{top + 36:g}" font-size="11.5" fill="#223">{escape(SUMMARIES[room])}</text>'
    if parts:
        yield f'<text x="{x:g}" y="{top + 52:g}" font-size="10.5" font-style="italic" fill="#556">{parts}</text>'


def make_picture() -> str:
    """Return the picture of the working copy."""
    return draw(build_graph("osimlite", exclude_type_checking_imports=True, cache_dir=None))


if __name__ == "__main__":
    PICTURE.write_text(make_picture(), encoding="utf-8")
