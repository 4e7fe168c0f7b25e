"""Simulate a model in one call, with the simulations of unchanged models kept in a cache.

What depends on the model alone is prepared once: calls in a loop take the prepared
:class:`~osimlite.simulation.run.Simulation` of the model out of the cache and put it back. Entries
belong to the component tree of a model, so that they end with it and with every change.
"""

from __future__ import annotations

import weakref
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from osimlite.schema.model import Model, check_is_model
from osimlite.simulation.engines import engine_name
from osimlite.simulation.options import RUN_OPTIONS, Options
from osimlite.simulation.run import SUMMARY_OPTIONS, Simulation
from osimlite.simulation.trajectory import Trajectory

if TYPE_CHECKING:
    from osimlite.schema.tree import Tree

CACHED_SIMULATIONS = 8
"""Number of models whose simulations stay in the cache."""

_RECENT_TREES: list[weakref.ref[Tree]] = []
"""Model trees in the cache, most recently used last (least recently used are dropped first)."""


def simulate(
    model: Model, to: float = 2.0, engine: str | None = None, **choices: Any
) -> Trajectory:
    """Simulate a model forward in time, by default from its default pose and speeds.

    Constraints, prescribed coordinates and loops hold to a tenth of the accuracy. If the start
    violates them, it is moved to the nearest state that fulfils them; values in `initial` and
    `initial_speeds` stay.

    What depends on the model alone is computed once and cached until the model changes, so that
    calls in a loop cost one run each. Files that the model names are read again for every call.
    Several threads may simulate the same model.

    Args:
        model: model to simulate.
        to: end of the motion, s.
        engine: engine that computes the accelerations: "compiled" (the default) or "bullet". A
            window (`show`) needs "bullet", which is the default there.
        choices: attributes of :class:`osimlite.simulation.Options`: `accuracy`, `integrator`,
            `fixed_step`, `report_interval`, `initial`, `initial_speeds`, `skip_unsupported` and
            others.

    Returns:
        The motion with its forces, energies and summary.

    Raises:
        Interrupted: Ctrl-C ended the motion; the exception has the trajectory up to there.
        ModelError: the model is not a mechanism, or a name does not exist.
        UnsupportedError: the model has a joint, constraint or force that osimlite cannot compute.
        SimulationError: the motion cannot continue (`trajectory` is the recorded part), no pose or
            speeds fulfil the constraints with the values that were set, or a coordinate that was
            set is locked or prescribed.
        SettingError: there is no such option, or a value has no meaning.
        MissingDependency: a package that the engine needs is not installed.
    """
    with _borrow_simulation(model, engine, choices) as simulation:
        trajectory = simulation.run(
            to, **{name: choices[name] for name in RUN_OPTIONS if name in choices}
        )
        simulation.hold()
        return trajectory


@contextmanager
def _borrow_simulation(
    model: Model, engine: str | None, choices: Mapping[str, Any]
) -> Iterator[Simulation]:
    """Take the simulation of an unchanged model out of the cache, or prepare one; put it back afterwards.

    While a thread uses a simulation, no other thread can take it. A simulation whose run failed is
    closed, not cached.

    Args:
        model: model to simulate.
        engine: name of the engine; None for the default one.
        choices: options of the simulation and of its runs by name.

    Yields:
        Simulation of the model as it is now.
    """
    check_is_model(model)
    tree = model.tree()
    options = Options.parse(choices)
    engine = None if engine is None else engine_name(engine)
    key = (
        engine_name(engine),
        *(getattr(options, name) for name in SUMMARY_OPTIONS),
        options.route,
    )
    is_plain = options.external_loads is None and not options.show
    simulation = tree.cached.pop(key, None) if is_plain else None
    # A simulation in use is not in the cache, so a second thread prepares its own.
    if simulation is None:
        simulation = Simulation(
            model, engine, **{name: choices[name] for name in choices if name not in RUN_OPTIONS}
        )
    elif options.initial or options.initial_speeds:
        # Another start may allow a motion without inertia where the first one did not.
        simulation.reset_inertia_check()
    try:
        yield simulation
    except BaseException:
        simulation.close()
        raise
    # Files that the model names may change unnoticed.
    if not is_plain or simulation.forces.reads_files or not tree.is_current:
        simulation.close()
        return
    tree.cached[key] = simulation
    _RECENT_TREES[:] = [
        reference for reference in _RECENT_TREES if reference() not in (None, tree)
    ] + [weakref.ref(tree)]
    # The list has weak references: the cache must not keep a model alive that its user has dropped.
    if len(_RECENT_TREES) > CACHED_SIMULATIONS:
        longest_ago = _RECENT_TREES.pop(0)()
        if longest_ago is not None:
            longest_ago.cached.clear()
