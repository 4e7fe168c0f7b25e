"""Measured loads beside the motion: on which foot they act, and what they carry."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from osimlite.errors import OsimliteError
from osimlite.io.tables.storage import StoTable
from osimlite.lint.config import Config
from osimlite.lint.engine import subject_of
from osimlite.lint.setup import Setup, members
from osimlite.lint.trial import Number
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.prescribed import ExternalForce
from osimlite.simulation.recorded_motion import RecordedMotion
from osimlite.tools.evidence import ON_GROUND, side_of
from osimlite.tools.trials.fit import Numbers
from osimlite.tools.trials.folder import LOADS, Missing, Tool

TIMES = 24
"""At so many times of those at which a load is large it is looked at."""
LARGE = 0.2
"""Of its largest force."""
SHORTEST = 0.3
"""A mean over less time (s) says nothing of the weight."""
GAP = 0.05
"""Of the weight: what carries less is no foot on a plate."""


class Load(NamedTuple):
    """A force that was measured."""

    item: ExternalForce  # of the document
    force: Array  # in its frame (t, 3), N
    point: Array | None  # in its frame (t, 3), m; None if there is none


class Scale(NamedTuple):
    """What residuals are compared with: the largest external force (N), and it times the mass centre's height (N m)."""

    force: float = float("nan")
    moment: float = float("nan")


def loads_of(tool: Tool) -> tuple[Path, StoTable, list[Load]]:
    """The loads of a tool that act: their file, the times of their data, and what acts.

    Raises:
        Missing: it has none, or they are not there.
    """
    file = tool.needed(LOADS)
    document, table = tool.folder.loads(file)
    return file, table, list(_loads(members(document, "ExternalForce"), table))


def _loads(items: Sequence[ExternalForce], table: StoTable) -> Iterator[Load]:
    for item in items:
        force = _three(table, item.force_identifier)
        if item.appliesForce and force is not None:
            yield Load(item, force, _three(table, item.point_identifier))


def _three(table: StoTable, identifier: str | None) -> Array | None:
    """The three columns (t, 3) whose labels begin so."""
    start = (identifier or "").strip()
    places = [
        place for place, label in enumerate(table.columns) if start and label.startswith(start)
    ]
    return table.rows[:, places] if len(places) == 3 else None


def scale_of(tool: Tool) -> Scale:
    """The largest sum of all loads at a time of the tool; nothing known if there are no loads."""
    try:
        _, table, loads = loads_of(tool)
    except OsimliteError:
        return Scale()
    own = (table.times >= tool.span[0]) & (table.times <= tool.span[1])
    if not loads or not own.any():
        return Scale()
    force = float(np.nanmax(np.linalg.norm(sum(load.force[own] for load in loads), axis=1)))
    try:
        motion, up = tool.motion, _up(tool)
    except OsimliteError:
        return Scale(force)
    chosen = np.unique(np.linspace(0, len(motion.times) - 1, TIMES).astype(int))
    height = np.mean([motion.mechanism.center_of_mass(motion.values[row]) @ up for row in chosen])
    floor = [float(np.median(load.point[own] @ up)) for load in loads if load.point is not None]
    return Scale(force, force * float(height - (min(floor) if floor else 0.0)))


def _up(tool: Tool) -> Array:
    gravity = np.asarray(tool.mechanism.gravity)
    size = float(np.linalg.norm(gravity))
    return -gravity / size if size else np.array([0.0, 1.0, 0.0])


def feet_numbers(tool: Tool) -> Numbers:
    """In how much of the time each load acts nearer to another foot than to its own."""
    file, table, loads = loads_of(tool)
    motion = tool.motion
    setup = subject_of(str(file), Config())
    bodies = [str(load.item.applied_to_body).rpartition("/")[2] for load in loads]
    known = {body.name.rpartition("/")[2] for body in motion.mechanism.bodies}
    for load, own in zip(loads, bodies, strict=True):
        others = {body for body in bodies if body != own} | {_mirrored(own)}
        others = {body for body in others if body in known}
        if load.point is None or own not in known or not others:
            continue
        away = _distances(motion, table, load, [own, *sorted(others)])
        if away is None:
            continue
        wrong = away[:, 1:].min(axis=1) < away[:, 0]
        other = sorted(others)[int(np.argmin(away[:, 1:].mean(axis=0)))]
        of = f"share of the time that the force '{load.item.name}' acts nearer to {other} than to {own}"
        side = f"it acts {away[:, 0].mean():.2g} m from {own} and {away[:, 1:].min(axis=1).mean():.2g} m from {other}"
        at = None
        if isinstance(setup, Setup):
            item = next(
                (item for item in setup.named("ExternalForce") if item.name == load.item.name), None
            )
            at = setup.position(item, tag="applied_to_body") if item is not None else None
        share = 100.0 * float(wrong.mean())
        yield (
            file,
            Number("swapped-feet", "share", of, share, "%", at=at, side=side if share else ""),
        )


def _mirrored(name: str) -> str:
    """The name of what is on the other side."""
    stem, side = side_of(name)
    other = {"r": "l", "l": "r"}.get(side, "")
    return (f"{stem}_{other}" if name.endswith(f"_{side}") else f"{other}_{stem}") if other else ""


def _distances(
    motion: RecordedMotion, table: StoTable, load: Load, bodies: Sequence[str]
) -> Array | None:
    """How far a load acts from the mass centres of bodies (t, b), m, at times at which it is large; None without."""
    assert load.point is not None
    sizes = np.linalg.norm(load.force, axis=1)
    within = (table.times >= motion.times[0]) & (table.times <= motion.times[-1])
    rows = np.flatnonzero(within & (sizes > max(ON_GROUND, LARGE * np.nanmax(sizes, initial=0.0))))
    if not len(rows):
        return None
    mechanism, result = motion.mechanism, []
    places = {body.name.rpartition("/")[2]: body for body in mechanism.bodies}
    for row in np.unique(rows[np.linspace(0, len(rows) - 1, TIMES).astype(int)]):
        q = motion.values[int(np.argmin(np.abs(motion.times - table.times[row])))]
        point = load.point[row]
        frame = str(load.item.point_expressed_in_body).rpartition("/")[2]
        if frame != "ground":
            point = mechanism.station_position(frame, point, q)
        centres = [
            mechanism.station_position(name, places[name].mass_properties.center, q)
            for name in bodies
        ]
        result.append([float(np.linalg.norm(point - centre)) for centre in centres])
    return np.array(result)


def weight_numbers(tool: Tool) -> Numbers:
    """By how much the mass of the model differs from what the plates carry."""
    _, table, loads = loads_of(tool)
    motion, up = tool.motion, _up(tool)
    gravity = float(np.linalg.norm(tool.mechanism.gravity))
    mass = tool.mechanism.total_mass
    if not loads or not mass or not gravity:
        raise Missing(f"{tool} has no loads on a model with a mass")
    if any(str(load.item.force_expressed_in_body).rpartition("/")[2] != "ground" for load in loads):
        raise Missing(f"the loads of {tool} are not expressed in ground")
    lift: Any = sum(load.force for load in loads) @ up
    times = table.times
    first = max(times[0], motion.times[0], tool.span[0])
    last = min(times[-1], motion.times[-1], tool.span[1])
    inside = np.flatnonzero((times >= first) & (times <= last) & (lift > GAP * mass * gravity))
    if len(inside) < 2 or times[inside[-1]] - times[inside[0]] < SHORTEST:
        raise Missing(f"no foot stands on a plate for {SHORTEST:g} s in {tool}")
    own = slice(int(inside[0]), int(inside[-1]) + 1)
    first, last = float(times[own][0]), float(times[own][-1])
    mean = float(np.trapezoid(lift[own], times[own])) / (last - first)
    smooth = motion.lowpassed(tool.cutoff) if tool.cutoff > 0.0 else motion
    speeds = [_rising(smooth, time, up) for time in (first, last)]
    carried = mean / (gravity + (speeds[1] - speeds[0]) / (last - first))
    of = f"the difference of the mass of the model, {mass:.4g} kg, from {carried:.4g} kg on the plates"
    where = f"mean from {first:.4g} to {last:.4g} s"
    value = 100.0 * abs(mass / carried - 1.0) if carried > 0.0 else float("inf")
    yield tool.model_file, Number("measured-weight", "difference", of, value, "%", where=where)


def _rising(motion: RecordedMotion, time: float, up: Array) -> float:
    """How fast the mass centre rises at a time, m/s."""
    row = int(np.argmin(np.abs(motion.times - time)))
    rates = motion.rates[0][row]
    speeds = motion.mechanism.speeds_from_rates(motion.values[row], rates)
    return float(motion.mechanism.center_of_mass_velocity(motion.values[row], speeds) @ up)
