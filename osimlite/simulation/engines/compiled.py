"""The compiled engine: accelerations, steps, events and batches in machine code.

The kernels of :mod:`osimlite.mechanics.kernels` are compiled with the force laws and the step
control that they call. The code serves every model, because models and parameters are arrays.
:mod:`osimlite.simulation.batches` describes batches.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.cores import count_cores
from osimlite.base.text import format_count, suggest_name
from osimlite.errors import OsimliteError, SimulationError
from osimlite.mechanics.kernels import record
from osimlite.mechanics.kernels.condensation import CONTACT_NUMBERS
from osimlite.mechanics.kernels.layout import ITEM, MODEL
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.schema.model import Model
from osimlite.simulation.batches import BatchEngine, BatchOptions, Runs, Watch
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.builder import OPENSIM
from osimlite.simulation.engines.base import KernelEngine
from osimlite.simulation.engines.batch import BatchWorkspace
from osimlite.simulation.engines.linking import describe_version
from osimlite.simulation.engines.protocol import EngineSettings

if TYPE_CHECKING:
    from osimlite.simulation.engines.model_update import NumberUpdater


def make_engine(mechanism: Mechanism, forces: Forces, settings: EngineSettings) -> BatchEngine:
    """Return a compiled engine.

    Raises:
        SimulationError: a window is requested.
        OsimliteError: there is no such route.
    """
    if settings.show:
        raise SimulationError(
            "the compiled engine shows no window; play the motion with osimlite view, or use the engine 'bullet'"
        )
    if settings.route not in ("auto", CompiledEngine.route):
        raise OsimliteError(
            f"the compiled engine has no route '{settings.route}'; leave it out; "
            "only engine 'bullet' has other routes"
        )
    return CompiledEngine(mechanism, forces)


RUNS_PER_TASK = 8
"""Number of runs that a thread computes before it takes the next ones."""


def run_many(
    engine: CompiledEngine,
    states: ArrayLike,
    options: BatchOptions,
    numbers: ArrayLike | None = None,
) -> Runs:
    """Return the results of a batch of runs with compiled kernels.

    See :meth:`osimlite.simulation.batches.BatchEngine.run_many`.

    Args:
        engine: the engine.
        states: initial states (W, y).
        options: options of the batch.
        numbers: numbers of models of the same structure (W, m); by default the engine's.

    Raises:
        SettingError: an option has no meaning.
        OsimliteError: the shapes of the states or numbers do not fit, or there is not one
            controller for each run.
    """
    from concurrent.futures import ThreadPoolExecutor

    starts = engine.state.to_table(states)
    options.check()
    vectors = _to_number_rows(engine, numbers)
    count = len(starts)
    if vectors.shape not in ((1, len(engine.numbers)), (count, len(engine.numbers))):
        raise OsimliteError(
            f"expected an array of the shape {(count, len(engine.numbers))}, one row for each run; got the "
            f"shape {vectors.shape}"
        )
    kinds, levels = _encode_watches(engine, options.watches)
    controller_runs = None
    if options.controllers:
        if len(options.controllers) != count:
            raise OsimliteError(
                f"got {format_count(len(options.controllers), 'controller')} for {format_count(count, 'run')}; "
                "give one for each run"
            )
        first, *others = options.controllers
        controller_runs = first.make_runs(engine, engine.forces.controls, other_controllers=others)
        # Each run writes its held controls into its own numbers.
        vectors = vectors if len(vectors) == count else np.tile(vectors, (count, 1))
    batch = BatchWorkspace(
        engine,
        starts,
        options,
        vectors=vectors,
        kinds=kinds,
        levels=levels,
        controller_runs=controller_runs,
    )

    def work(first: int) -> None:
        # Each task has a workspace of its own, as threads run at the same time.
        batch.run(batch.make_workspace(), first, min(first + RUNS_PER_TASK, count))

    # Threads suffice, because ctypes releases Python's global lock during a call.
    with ThreadPoolExecutor(options.threads or count_cores()) as pool:
        list(pool.map(work, range(0, count, RUNS_PER_TASK)))
    names = [*engine.contacts, *(watch.name for watch in options.watches)]
    recorded_events = [
        rows[:total]
        for rows, total in zip(batch.events, batch.counts[:, record.COUNTS.EVENTS], strict=True)
    ]
    named = [
        [(t, names[int(number)], begins > 0.0) for t, number, begins in rows[:, :3].tolist()]
        for rows in recorded_events
    ]
    at_events = [rows[:, 3:] for rows in recorded_events] if options.event_states else []
    return Runs(
        batch.clocks[:, 0].copy(),
        batch.states,
        batch.endings,
        batch.counts[:, :3].copy(),
        batch.reports,
        named,
        batch.peaks,
        at_events,
    )


def locate_contacts(
    engine: CompiledEngine,
    states: ArrayLike,
    numbers: ArrayLike | None = None,
    rows: ArrayLike | None = None,
) -> Floats:
    """Return the surfaces of all contacts (k, P, 9).

    See :meth:`osimlite.simulation.batches.BatchEngine.locate_contacts`.

    Args:
        engine: the engine.
        states: states (k, y).
        numbers: numbers of models of the same structure (v, m); by default the engine's.
        rows: row of `numbers` for each state (k,); by default the first.
    """
    vectors = _to_number_rows(engine, numbers)
    state_table = engine.state.to_table(states)
    which = (
        np.zeros(len(state_table), dtype=np.int64)
        if rows is None
        else np.array(rows, dtype=np.int64)
    )
    contact_points = np.zeros((len(state_table), len(engine.contacts), 9))
    w = np.zeros(engine.structure[MODEL.WORK_SIZE])
    derivative = np.zeros(engine.state.size)
    arrays = vectors, w, vectors.shape[1], which, state_table, derivative, contact_points
    engine.program.code.get_entry("contact_places")(engine.program.ints, *arrays, len(state_table))
    return contact_points


def get_contact_radii(engine: CompiledEngine, numbers: ArrayLike | None = None) -> Floats:
    """Return the radii of the second surfaces.

    Args:
        engine: the engine.
        numbers: numbers of models of the same structure (v, m); by default the engine's.

    Returns:
        Radii (v, P), m.
    """
    s = engine.structure
    records = s[s[MODEL.CONTACT_AT] : s[MODEL.CONTACT_AT] + len(engine.contacts)]
    # Read from the numbers, as runs may differ in their radii.
    return _to_number_rows(engine, numbers)[:, s[records + ITEM.NUMBERS] + CONTACT_NUMBERS.RADIUS]


def _to_number_rows(engine: CompiledEngine, numbers: ArrayLike | None) -> Floats:
    """Return numbers of models as contiguous rows (v, m); the engine's by default."""
    vectors = np.array(engine.numbers if numbers is None else numbers, dtype=np.float64, order="C")
    return vectors.reshape(-1, vectors.shape[-1])


def _encode_watches(engine: CompiledEngine, watches: Sequence[Watch]) -> tuple[Ints, Floats]:
    """Return watches in the form of the kernels.

    Args:
        engine: the engine.
        watches: the watches.

    Returns:
        Kinds (k, 3) and levels (k, 7).

    Raises:
        OsimliteError: a watch does not name exactly one thing, or names a locked coordinate or no
            contact of the model.
    """
    kinds = np.zeros((len(watches), 3), dtype=np.int64)
    levels = np.zeros((len(watches), 7))
    mechanism = engine.mechanism
    for row, watch in enumerate(watches):
        if bool(watch.coordinate) + bool(watch.body) + bool(watch.contact) != 1:
            raise OsimliteError(
                f"the watch '{watch.name}' must name exactly one of: coordinate, body, contact"
            )
        if watch.coordinate:
            coordinate = mechanism.coordinate_index(watch.coordinate)
            if coordinate not in engine.order:
                raise OsimliteError(
                    f"the watch '{watch.name}' names the coordinate '{watch.coordinate}', which is locked"
                )
            kinds[row] = record.WATCH.COORDINATE, engine.order.index(coordinate), watch.stops
            levels[row, 6] = watch.level
        elif watch.contact:
            if watch.contact not in engine.contacts:
                near = suggest_name(watch.contact, engine.contacts)
                raise OsimliteError(f"the model has no contact '{watch.contact}'{near}")
            kinds[row] = record.WATCH.TOUCH, engine.contacts.index(watch.contact), watch.stops
        else:
            body, frame = mechanism.placement(watch.body)
            link, body_in_link = (-1, np.eye(4)) if body < 0 else engine.placements[body]
            # The kernels know links, not bodies, so the point is expressed in the frame of the
            # link.
            station = (body_in_link @ frame @ np.array((*watch.station, 1.0)))[:3]
            kinds[row] = record.WATCH.HEIGHT, link, watch.stops
            levels[row] = (*station, *watch.direction, watch.level)
    return kinds, levels


class CompiledEngine(KernelEngine):
    """Engine that computes accelerations in machine code.

    Its methods are those of :class:`osimlite.simulation.engines.protocol.Engine` and
    :class:`osimlite.simulation.batches.BatchEngine`.

    Args:
        mechanism: the mechanism.
        forces: forces on it besides gravity.

    Raises:
        UnsupportedError: the kernels do not support a joint, function, constraint or force.
    """

    name = "compiled"
    version = describe_version()
    route = "composite-rigid-body"

    def __reduce__(self) -> Any:
        # Addresses are not valid in another process.
        return CompiledEngine, (self.mechanism, self.forces)

    run_many = run_many
    locate_contacts = locate_contacts
    get_contact_radii = get_contact_radii

    def make_updater(self, model: Model, folder: Path, wrapping: str = OPENSIM) -> NumberUpdater:
        """Return an updater of parts of the model.

        Args:
            model: the engine's model, whose numbers will change.
            folder: folder of the model's file.
            wrapping: method of wrapping, see :class:`osimlite.simulation.Options`.
        """
        from osimlite.simulation.engines.model_update import NumberUpdater

        return NumberUpdater(model, self, folder, wrapping)
