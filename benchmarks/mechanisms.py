"""One evaluation of the accelerations, from chains of pendulums to whole bodies: osimlite's ways and OpenSim's.

What is timed is one call from Python: state in, accelerations out, under gravity and constraints
alone. All ways run in turn in one process; what counts is the median of the rounds, each the mean
of some calls. "Bullet" is what a simulation takes by itself, "recursion" osimlite's own kinematics
and dynamics in numpy, "compiled" the machine code. OpenSim is made to compute everything again by
setting the time of its state.

The models of the second table are those of the shared corpus, if that stands beside the repository.
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
from osimlite import Body, Coordinate, Model, PinJoint
from osimlite.errors import OsimliteError
from osimlite.mechanics.multibody import Mechanism, build_mechanism
from osimlite.schema.forces import Force
from osimlite.simulation.elements import Forces
from osimlite.simulation.engines import engine_factory
from osimlite.simulation.engines.protocol import EngineSettings

CORPUS = Path(__file__).resolve().parents[2] / "shared" / "corpus" / "converted"
LENGTHS = (2, 5, 10, 20, 40, 80)
REAL = {
    "m0005": "gait10dof18musc",
    "m0013": "gait2392",
    "m0079": "full body, running",
    "m0954": "Rajagopal, patellas on couplers",
    "m0163": "shoulder, one closed loop",
    "m0168": "neck, 22 constraints",
}
WAYS = {
    "Bullet": ("bullet", "auto"),
    "compiled": ("compiled", "auto"),
}
ROUNDS, SECONDS = 15, 0.01

Call = Callable[[], object]


def main() -> None:
    opensim.Logger.setLevelString("off")
    console = Console(width=110)
    chains = {f"{count} pins": chain(count) for count in LENGTHS}
    times = table("Chains", chains, console)
    for way in times[0]:
        small, large = times[LENGTHS.index(10)][way], times[LENGTHS.index(80)][way]
        if small and large:
            slope = math.log(large / small) / math.log(8.0)
            console.print(
                f"{way}: from 10 to 80 degrees of freedom the time grows with their power {slope:.2f}"
            )
    if CORPUS.is_dir():
        table(
            "Models of the corpus, forces left out",
            {name: real(name_of) for name_of, name in REAL.items()},
            console,
        )


def chain(count: int) -> Model:
    """Pendulums on each other, whose axes point to all sides."""
    model, carrier = Model(name="chain"), None
    for number in range(count):
        inertia = (0.02, 0.03, 0.025, 0.001, 0.0, 0.0)
        body = model.add(
            Body(name=f"b{number}", mass=1.0, mass_center=(0.02, -0.1, 0.01), inertia=inertia)
        )
        joint = PinJoint(
            name=f"j{number}", coordinates=[Coordinate(name=f"q{number}", default_value=0.1)]
        )
        turned = ((0.0, 0.0, 0.0), (1.2, 0.0, 0.0), (0.0, 1.1, 0.3))[number % 3]
        model.add(
            joint.between(
                carrier or model.ground,
                body,
                at=(0.0, -0.2 if carrier else 0.0, 0.0),
                turned=turned,
            )
        )
        carrier = body
    return model


def real(name: str) -> Model:
    """A model of the corpus without forces."""
    model = osimlite.read_text(gzip.decompress((CORPUS / f"{name}.osim.gz").read_bytes()).decode())
    for force in model.components(Force):
        force.appliesForce = False
    return model


def table(title: str, models: dict[str, Model], console: Console) -> list[dict[str, float | None]]:
    """Time all models, print the table, and return its numbers (s)."""
    printed = Table(title=title, caption="microseconds for one evaluation; ratio: Bullet / OpenSim")
    printed.add_column("", no_wrap=True)
    for heading in ("coordinates", "constraints", *WAYS, "OpenSim", "ratio"):
        printed.add_column(heading, justify="right", no_wrap=True)
    rows = []
    for name, model in models.items():
        mechanism = build_mechanism(model)
        times = timed(model, mechanism)
        kept = sum(
            len(item.velocity_equations(mechanism.at({}))[1]) for item in mechanism.constraints
        )
        cells = ["-" if seconds is None else f"{1e6 * seconds:.0f}" for seconds in times.values()]
        ours, theirs = times["Bullet"], times["OpenSim"]
        ratio = f"{ours / theirs:.1f}" if ours and theirs else "-"
        printed.add_row(name, str(len(mechanism.coordinates)), str(kept), *cells, ratio)
        rows.append(times)
    console.print(printed)
    return rows


def timed(model: Model, mechanism: Mechanism) -> dict[str, float | None]:
    """Seconds of one evaluation in each way; None where it refuses the model."""
    q, u = mechanism.default_state()
    moving = np.array([not info.locked for info in mechanism.coordinates])
    u = mechanism.project_speeds(q, moving * np.random.default_rng(1).uniform(-1.0, 1.0, len(q)))
    with ExitStack() as stack:
        calls: dict[str, Call | None] = {}
        for way, (engine, route) in WAYS.items():
            calls[way] = None
            try:
                made: Any = engine_factory(engine)(
                    mechanism, Forces(()), EngineSettings(route=route)
                )
            except OsimliteError:
                continue
            stack.callback(made.close)
            state = made.state.pack(q.tolist(), u.tolist())
            calls[way] = partial(made.compute_derivative, 0.0, state)
        calls["OpenSim"] = theirs(model, q, u)
        return medians(calls)


def theirs(model: Model, q: Any, u: Any) -> Call:
    """OpenSim's evaluation at a state."""
    with tempfile.TemporaryDirectory() as folder:
        osimlite.write(model, Path(folder, "model.osim"))
        their_model = opensim.Model(str(Path(folder, "model.osim")))
    state = their_model.initSystem()
    coordinates = their_model.getCoordinateSet()
    for place in range(len(q)):
        coordinate = coordinates.get(place)
        if not coordinate.getLocked(state):
            coordinate.setValue(state, float(q[place]), False)
        coordinate.setSpeedValue(state, float(u[place]))

    def evaluate() -> None:
        state.setTime(0.0)
        their_model.realizeAcceleration(state)

    return evaluate


def medians(calls: dict[str, Call | None]) -> dict[str, float | None]:
    """Median time of each call (s), the calls taking turns."""
    rounds: dict[str, list[float]] = {way: [] for way in calls}
    counts: dict[str, int] = {}
    for _ in range(ROUNDS):
        for way, call in calls.items():
            if call is None:
                continue
            if way not in counts:
                call()
                counts[way] = max(1, round(SECONDS / spent(call, 1)))
            rounds[way].append(spent(call, counts[way]) / counts[way])
    return {way: median(found) if found else None for way, found in rounds.items()}


def spent(call: Call, count: int) -> float:
    """Seconds of some calls."""
    start = time.perf_counter()
    for _ in range(count):
        call()
    return time.perf_counter() - start


if __name__ == "__main__":
    main()
