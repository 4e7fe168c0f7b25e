"""Simulation of several models for half a second: osimlite's engines and OpenSim in turn.

    python benchmarks/motions.py [FILE ...]

Without files, the models are a double pendulum, a block on four spheres, and models of the shared
corpus if it is present. Muscles and path springs are disabled in both programs, and so is every
force that osimlite does not support. Simulations begin with the default pose.

The first table has the differences between the programs at the end, at the same accuracy: the
largest difference of any coordinate (rad or m). The second has the processor times of the motion
alone; models are read and initialised before.
"""

from __future__ import annotations

import gzip
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import opensim
from rich.console import Console
from rich.table import Table

import osimlite
from _corpus import CORPUS
from _pair import Pair, print_pairs, time_pair
from osimlite import (
    Body,
    ContactHalfSpace,
    ContactSphere,
    Coordinate,
    FreeJoint,
    HuntCrossleyForce,
    Model,
    PinJoint,
)
from osimlite.errors import OsimliteError
from osimlite.schema.forces import Force
from osimlite.schema.muscles import Muscle
from osimlite.schema.path_forces import PathSpring
from osimlite.simulation import Simulation
from osimlite.simulation.elements.registry import FORCE_TYPES
from simulate import prepare_opensim_runs, prepare_osimlite_runs

CORPUS_MODELS = {
    "m0005": "gait10dof18musc",
    "m0013": "gait2392",
    "m0954": "Rajagopal",
    "m0161": "a shoulder",
}
"""Names of models in the corpus, and their titles in the tables."""

TO = 0.5
"""End of the simulation (s)."""

ACCURACY = 1e-6
"""Relative accuracy of the integrators."""

ROUNDS = 5
"""Number of timed pairs of runs."""

ENGINES = {"PyBullet": "bullet", "compiled": "compiled"}
"""Heading of each engine of osimlite in the tables, and its name in the package."""


def main() -> None:
    opensim.Logger.setLevelString("off")
    console = Console()
    times: list[Pair] = []
    differences = Table(
        title=f"Differences after {TO:g} s at accuracy {ACCURACY:g}, rad or m",
    )
    for heading in ("model", "degrees of freedom", *ENGINES):
        differences.add_column(heading, justify="left" if heading == "model" else "right")
    with tempfile.TemporaryDirectory() as folder:
        for name, file in write_models(Path(folder)):
            opensim_model = opensim.Model(str(file))
            opensim_model.initSystem()
            cells = dict.fromkeys(ENGINES, "refused")
            size = 0
            for heading, engine in ENGINES.items():
                try:
                    simulation = Simulation(osimlite.read(file), engine, opensim_derivatives=True)
                # An engine may not support a joint or constraint of the model.
                except OsimliteError as error:
                    console.print(f"{name}: {error}", highlight=False)
                    continue
                with simulation:
                    difference, row = compare(f"{name}, {heading}", simulation, opensim_model)
                    cells[heading] = f"{difference:.1e}"
                    times.append(row)
                    size = len(simulation.engine.order)
            differences.add_row(name, str(size), *cells.values())
    console.print(differences)
    print_pairs(f"{TO:g} s, warm, accuracy {ACCURACY:g}", times, console=console)


def compare(title: str, simulation: Simulation, opensim_model: Any) -> tuple[float, Pair]:
    """Simulate a model with both programs.

    Args:
        title: name of the row of times.
        simulation: simulation of osimlite.
        opensim_model: the same model in OpenSim.

    Returns:
        Largest difference of a coordinate at the end (rad or m), and the times.
    """
    ours = prepare_osimlite_runs(simulation, ACCURACY, TO)
    # One run for the difference, one as warm-up, and one for each round.
    theirs = prepare_opensim_runs(opensim_model, ACCURACY, ROUNDS + 2, TO)
    # The programs may order the coordinates differently.
    names = [info.name for info in simulation.mechanism.coordinates]
    opensim_names = [coordinate.getName() for coordinate in opensim_model.getCoordinateSet()]
    end = dict(zip(names, ours(), strict=True))
    opensim_end = dict(zip(opensim_names, theirs(), strict=True))
    difference = max(abs(end[name] - opensim_end[name]) for name in end)
    times = time_pair(title, ours=ours, theirs=theirs, rounds=ROUNDS, clock=time.process_time)
    return difference, times


def write_models(folder: Path) -> Iterator[tuple[str, Path]]:
    """Write the models into a folder, without forces that only one of the programs computes.

    Yields:
        Name and file of each model.
    """
    for number, (name, model) in enumerate(read_models()):
        for force in model.components(Force):
            # Muscles would need equilibrium at the start; they are compared by muscles.py.
            is_supported = FORCE_TYPES.find(type(force)) is not None
            if not is_supported or isinstance(force, PathSpring | Muscle):
                force.appliesForce = False
        path = folder / f"{number}.osim"
        osimlite.write(model, path)
        yield name, path


def read_models() -> list[tuple[str, Model]]:
    """Return the models of the command line, or the default ones, with their names."""
    files = [Path(word) for word in sys.argv[1:]]
    if files:
        return [(path.stem, osimlite.read(path)) for path in files]
    models = [("double pendulum", build_pendulum()), ("block on balls", build_block())]
    for name, title in CORPUS_MODELS.items():
        path = CORPUS / f"{name}.osim.gz"
        if path.exists():
            models.append((title, osimlite.read_text(gzip.decompress(path.read_bytes()))))
    return models


def build_pendulum() -> Model:
    """Return a double pendulum: two rods of 1 m on pin joints."""
    model = Model(name="pendulum")
    parent = model.ground
    for name in ("upper", "lower"):
        rod = model.add(Body(name=name, mass=1.0, inertia=(0.1, 0.01, 0.1, 0.0, 0.0, 0.0)))
        pin = PinJoint(
            name=f"pin_{name}", coordinates=[Coordinate(name=f"angle_{name}", default_value=1.0)]
        )
        position = (0.0, -0.5, 0.0) if name == "lower" else (0.0, 0.0, 0.0)
        model.add(pin.between(parent, rod, at=position, child_at=(0.0, 0.5, 0.0)))
        parent = rod
    return model


def build_block() -> Model:
    """Return a block with spheres at its lower corners that falls obliquely onto the floor."""
    model = Model(name="block")
    body = model.add(Body(name="block", mass=2.0, inertia=(0.02, 0.03, 0.02, 0.0, 0.0, 0.0)))
    starts = {"rx": 0.2, "ry": 0.0, "rz": 0.1, "tx": 0.0, "ty": 0.4, "tz": 0.0}
    coordinates = [Coordinate(name=name, default_value=value) for name, value in starts.items()]
    model.add(FreeJoint(name="free", coordinates=coordinates).between(model.ground, body))
    # A half space extends along +x of its frame; this rotation turns it downwards.
    orientation = (0.0, 0.0, -1.5707963267948966)
    floor = model.add(
        ContactHalfSpace(name="floor", socket_frame=model.ground, orientation=orientation)
    )
    for number, (x, z) in enumerate(((-1, -1), (-1, 1), (1, -1), (1, 1))):
        location = (0.15 * x, -0.1, 0.15 * z)
        sphere = model.add(
            ContactSphere(name=f"ball{number}", socket_frame=body, location=location, radius=0.05)
        )
        material = HuntCrossleyForce.ContactParameters(
            geometry=(sphere, floor),
            stiffness=1e6,
            dissipation=1.0,
            static_friction=0.6,
            dynamic_friction=0.5,
        )
        parameters = HuntCrossleyForce.ContactParametersSet(objects=[material])
        model.add(HuntCrossleyForce(name=f"contact{number}", contact_parameters=parameters))
    return model


if __name__ == "__main__":
    main()
