"""Time of one evaluation of accelerations, from chains of pendulums to complete bodies.

    python benchmarks/mechanisms.py

An evaluation is one call from Python: from the state to the accelerations, under gravity and
constraints only. Compared are osimlite with PyBullet, osimlite's compiled kernels, and OpenSim.
They run in turn in one process; the tables show the median of the rounds, each the mean of several
calls, in microseconds. The ratio is that of the time with PyBullet to the time of OpenSim.

The first table has chains of pendulums and is followed by the growth of the times with the number
of degrees of freedom. The second has models of the shared corpus without their forces, and is
omitted if the corpus is absent.
"""

from __future__ import annotations

import gzip
import math
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import opensim
from rich.console import Console
from rich.table import Table

import osimlite
from _corpus import CORPUS
from osimlite import Body, Coordinate, Model, PinJoint
from osimlite.errors import OsimliteError
from osimlite.mechanics.multibody import Mechanism, build_mechanism
from osimlite.schema.forces import Force
from osimlite.simulation.elements import Forces
from osimlite.simulation.engines import engine_factory
from osimlite.simulation.engines.protocol import EngineSettings

CHAIN_LENGTHS = (2, 5, 10, 20, 40, 80)
"""Numbers of pendulums in the chains."""

GROWTH_LENGTHS = (10, 80)
"""Two of these numbers, between which the growth of the times is computed."""

# These range from legs without constraints to closed loops and many constraints.
CORPUS_MODELS = {
    "m0005": "gait10dof18musc",
    "m0013": "gait2392",
    "m0079": "full body, running",
    "m0954": "Rajagopal, patellas on couplers",
    "m0163": "shoulder, one closed loop",
    "m0168": "neck, 22 constraints",
}
"""Names of models in the corpus, and their titles in the table."""

ENGINES = {"Bullet": "bullet", "compiled": "compiled"}
"""Heading of each engine of osimlite in the tables, and its name in the package."""

ROUNDS = 15
"""Number of rounds, of which the median counts."""

# One call takes microseconds. A round of this length is far above the resolution of the clock.
ROUND_SECONDS = 0.01
"""Duration of one round (s), from which the number of calls follows."""

Call = Callable[[], object]
Times = dict[str, float | None]
"""Time of one evaluation (s) by heading; None if the program does not support the model."""


def main() -> None:
    opensim.Logger.setLevelString("off")
    console = Console(width=110)
    chains = {f"{count} pins": build_chain(count) for count in CHAIN_LENGTHS}
    print_growth(print_times("Chains", chains, console), console)
    if CORPUS.is_dir():
        models = {title: read_without_forces(name) for name, title in CORPUS_MODELS.items()}
        print_times("Models of the corpus, without forces", models, console)


def build_chain(count: int) -> Model:
    """Return a chain of pendulums whose axes have different directions."""
    model = Model(name="chain")
    parent = None
    for index in range(count):
        # The product of inertia makes the matrix a general one.
        inertia = (0.02, 0.03, 0.025, 0.001, 0.0, 0.0)
        body = model.add(
            Body(name=f"b{index}", mass=1.0, mass_center=(0.02, -0.1, 0.01), inertia=inertia)
        )
        joint = PinJoint(
            name=f"j{index}", coordinates=[Coordinate(name=f"q{index}", default_value=0.1)]
        )
        # The frames differ, so that the axes of consecutive joints have different directions.
        orientation = ((0.0, 0.0, 0.0), (1.2, 0.0, 0.0), (0.0, 1.1, 0.3))[index % 3]
        model.add(
            joint.between(
                parent or model.ground,
                body,
                at=(0.0, -0.2 if parent else 0.0, 0.0),
                turned=orientation,
            )
        )
        parent = body
    return model


def read_without_forces(name: str) -> Model:
    """Return a model of the corpus whose forces are disabled."""
    model = osimlite.read_text(gzip.decompress((CORPUS / f"{name}.osim.gz").read_bytes()).decode())
    for force in model.components(Force):
        force.appliesForce = False
    return model


def print_times(title: str, models: dict[str, Model], console: Console) -> list[Times]:
    """Time evaluations of models and print a table.

    Args:
        title: title of the table.
        models: models by the name of their row.
        console: console to print to.

    Returns:
        Times of each model (s).
    """
    table = Table(title=title, caption="microseconds for one evaluation; ratio: Bullet / OpenSim")
    table.add_column("", no_wrap=True)
    for heading in ("coordinates", "constraints", *ENGINES, "OpenSim", "ratio"):
        table.add_column(heading, justify="right", no_wrap=True)
    rows = []
    for name, model in models.items():
        mechanism = build_mechanism(model)
        times = time_model(model, mechanism)
        state = mechanism.at({})
        constraint_count = sum(
            len(item.velocity_equations(state)[1]) for item in mechanism.constraints
        )
        cells = ["-" if seconds is None else f"{1e6 * seconds:.0f}" for seconds in times.values()]
        ours = times["Bullet"]
        theirs = times["OpenSim"]
        ratio = f"{ours / theirs:.1f}" if ours and theirs else "-"
        table.add_row(name, str(len(mechanism.coordinates)), str(constraint_count), *cells, ratio)
        rows.append(times)
    console.print(table)
    return rows


def print_growth(rows: list[Times], console: Console) -> None:
    """Print the power of the number of degrees of freedom with which each time grows.

    Args:
        rows: times of the chains, in the order of `CHAIN_LENGTHS`.
        console: console to print to.
    """
    few, many = GROWTH_LENGTHS
    for program in rows[0]:
        short = rows[CHAIN_LENGTHS.index(few)][program]
        long = rows[CHAIN_LENGTHS.index(many)][program]
        if short and long:
            power = math.log(long / short) / math.log(many / few)
            console.print(
                f"{program}: from {few} to {many} degrees of freedom, the time grows "
                f"with their power {power:.2f}"
            )


def time_model(model: Model, mechanism: Mechanism) -> Times:
    """Return the time of one evaluation with each engine and with OpenSim (s)."""
    q, u = mechanism.default_state()
    moving = np.array([not info.locked for info in mechanism.coordinates])
    # Random speeds make the velocity-dependent terms nonzero, as in a simulation.
    u = mechanism.project_speeds(q, moving * np.random.default_rng(1).uniform(-1.0, 1.0, len(q)))
    with ExitStack() as stack:
        calls: dict[str, Call | None] = {}
        for name, engine_name in ENGINES.items():
            calls[name] = None
            try:
                engine: Any = engine_factory(engine_name)(
                    mechanism, Forces(()), EngineSettings(route="auto")
                )
            # An engine may not support a constraint of the model; the table then has a dash.
            except OsimliteError:
                continue
            stack.callback(engine.close)
            state = engine.state.pack(q.tolist(), u.tolist())
            calls[name] = partial(engine.compute_derivative, 0.0, state)
        calls["OpenSim"] = prepare_opensim(model, q, u)
        return time_in_turn(calls)


def prepare_opensim(model: Model, q: Any, u: Any) -> Call:
    """Return a function that evaluates the accelerations in OpenSim.

    Args:
        model: model of osimlite.
        q: coordinates (n,), rad or m.
        u: generalized speeds (n,), rad/s or m/s.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "model.osim")
        osimlite.write(model, path)
        opensim_model = opensim.Model(str(path))
    state = opensim_model.initSystem()
    coordinates = opensim_model.getCoordinateSet()
    for index in range(len(q)):
        coordinate = coordinates.get(index)
        if not coordinate.getLocked(state):
            # Without enforcing constraints: only all coordinates together fulfil them.
            coordinate.setValue(state, float(q[index]), False)
        coordinate.setSpeedValue(state, float(u[index]))

    def evaluate() -> None:
        # Setting the time invalidates the results, so that OpenSim computes them again.
        state.setTime(0.0)
        opensim_model.realizeAcceleration(state)

    return evaluate


def time_in_turn(calls: dict[str, Call | None]) -> Times:
    """Return the median time of each call (s); the calls take turns."""
    rounds: dict[str, list[float]] = {name: [] for name in calls}
    # Fast calls are repeated more often, so that all rounds take about as long.
    counts: dict[str, int] = {}
    for _ in range(ROUNDS):
        for name, call in calls.items():
            if call is None:
                continue
            if name not in counts:
                # The first call compiles or loads code; the second one shows the usual time.
                call()
                counts[name] = max(1, round(ROUND_SECONDS / time_calls(call, 1)))
            rounds[name].append(time_calls(call, counts[name]) / counts[name])
    return {name: median(times) if times else None for name, times in rounds.items()}


def time_calls(call: Call, count: int) -> float:
    """Return the time of `count` calls (s)."""
    start = time.perf_counter()
    for _ in range(count):
        call()
    return time.perf_counter() - start


if __name__ == "__main__":
    main()
