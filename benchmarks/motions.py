"""Other models in motion: half a second from the default pose, osimlite's engines and OpenSim, side by side in one run.

    python benchmarks/motions.py [FILE ...]

Without files: a double pendulum, a block on four balls, and real models of the shared corpus if
that stands beside the repository. Muscles and paths that wrap act in neither program. Times are of
the processor, warm; "apart" is the largest difference (rad or m) between the two programs at the
end, at the same accuracy.
"""

from __future__ import annotations

import gzip
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import opensim
from rich.console import Console
from rich.table import Table

import osimlite
from _pair import pair, report
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

CORPUS = Path(__file__).resolve().parents[2] / "shared" / "corpus" / "converted"
REAL = {
    "m0005": "gait10dof18musc",
    "m0013": "gait2392",
    "m0954": "Rajagopal",
    "m0161": "a shoulder",
}
TO, ACCURACY, ROUNDS = 0.5, 1e-6, 5


def main() -> None:
    opensim.Logger.setLevelString("off")
    console, times = Console(), []
    apart = Table(title=f"Differences after {TO:g} s at accuracy {ACCURACY:g}")
    for heading in ("model", "degrees of freedom", "PyBullet", "compiled"):
        apart.add_column(heading, justify="left" if heading == "model" else "right")
    with tempfile.TemporaryDirectory() as folder:
        for name, file in models(Path(folder)):
            theirs_model = opensim.Model(str(file))
            theirs_model.initSystem()
            cells = {}
            for title, engine in (("PyBullet", "bullet"), ("compiled", "compiled")):
                try:
                    simulation = Simulation(osimlite.read(file), engine, opensim_derivatives=True)
                except OsimliteError as error:
                    console.print(f"{name}: {error}", highlight=False)
                    continue
                with simulation:
                    ours = prepare_osimlite_runs(simulation, ACCURACY, TO)
                    theirs = prepare_opensim_runs(theirs_model, ACCURACY, ROUNDS + 2, TO)
                    places = [info.name for info in simulation.mechanism.coordinates]
                    names = [coordinate.getName() for coordinate in theirs_model.getCoordinateSet()]
                    mine = dict(zip(places, ours(), strict=True))
                    other = dict(zip(names, theirs(), strict=True))
                    cells[title] = f"{max(abs(mine[key] - other[key]) for key in mine):.1e}"
                    words = f"{name}, {title}"
                    times.append(
                        pair(
                            words, ours=ours, theirs=theirs, rounds=ROUNDS, clock=time.process_time
                        )
                    )
                    size = len(simulation.engine.order)
            apart.add_row(
                name, str(size), cells.get("PyBullet", "refused"), cells.get("compiled", "refused")
            )
    console.print(apart)
    report(f"{TO:g} s, warm, accuracy {ACCURACY:g}", times, console=console)


def models(folder: Path) -> Iterator[tuple[str, Path]]:
    """Name and file of each model, without the forces that only one of the programs computes."""
    given = [Path(word) for word in sys.argv[1:]]
    found = [(path.stem, osimlite.read(path)) for path in given]
    if not given:
        found = [("double pendulum", pendulum()), ("block on balls", block())]
        for key, name in REAL.items():
            path = CORPUS / f"{key}.osim.gz"
            if path.exists():
                found.append((name, osimlite.read_text(gzip.decompress(path.read_bytes()))))
    for number, (name, model) in enumerate(found):
        for force in model.components(Force):
            known = FORCE_TYPES.find(type(force)) is not None
            if not known or isinstance(force, PathSpring | Muscle):
                force.appliesForce = False
        path = folder / f"{number}.osim"
        osimlite.write(model, path)
        yield name, path


def pendulum() -> Model:
    """Two rods on pins."""
    model = Model(name="pendulum")
    above = model.ground
    for name in ("upper", "lower"):
        rod = model.add(Body(name=name, mass=1.0, inertia=(0.1, 0.01, 0.1, 0.0, 0.0, 0.0)))
        pin = PinJoint(
            name=f"pin_{name}", coordinates=[Coordinate(name=f"angle_{name}", default_value=1.0)]
        )
        model.add(
            pin.between(
                above,
                rod,
                at=(0.0, -0.5, 0.0) if name == "lower" else (0.0, 0.0, 0.0),
                child_at=(0.0, 0.5, 0.0),
            )
        )
        above = rod
    return model


def block() -> Model:
    """A block that falls askew onto the floor, on balls at its lower corners."""
    model = Model(name="block")
    body = model.add(Body(name="block", mass=2.0, inertia=(0.02, 0.03, 0.02, 0.0, 0.0, 0.0)))
    starts = {"rx": 0.2, "ry": 0.0, "rz": 0.1, "tx": 0.0, "ty": 0.4, "tz": 0.0}
    coordinates = [Coordinate(name=name, default_value=value) for name, value in starts.items()]
    model.add(FreeJoint(name="free", coordinates=coordinates).between(model.ground, body))
    turned = (0.0, 0.0, -1.5707963267948966)
    floor = model.add(ContactHalfSpace(name="floor", socket_frame=model.ground, orientation=turned))
    for number, (x, z) in enumerate(((-1, -1), (-1, 1), (1, -1), (1, 1))):
        place = (0.15 * x, -0.1, 0.15 * z)
        ball = model.add(
            ContactSphere(name=f"ball{number}", socket_frame=body, location=place, radius=0.05)
        )
        one = HuntCrossleyForce.ContactParameters(
            geometry=(ball, floor),
            stiffness=1e6,
            dissipation=1.0,
            static_friction=0.6,
            dynamic_friction=0.5,
        )
        parameters = HuntCrossleyForce.ContactParametersSet(objects=[one])
        model.add(HuntCrossleyForce(name=f"contact{number}", contact_parameters=parameters))
    return model


if __name__ == "__main__":
    main()
