"""Print digests of motions and derivatives of models, computed by the kernels of one library.

Arguments of the program: path of a shared library with all kernels, number of motions, and number
of models whose derivatives are computed. With `-` for the path, osimlite selects its kernels as
usual. Models of the shared folder are added, half as many, if it exists.
"""

from __future__ import annotations

import ctypes
import hashlib
import json
import sys
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import osimlite
from osimlite.models.jumper import jumper
from osimlite.models.walkers import furthest_walker
from osimlite.simulation.batches import run_many
from osimlite.simulation.engines import machine_code
from osimlite.simulation.run import Simulation
from tests.simulation.force_cases import FORCES, with_force

ROOT = Path(__file__).parents[3]
DURATION = 0.1
"""Duration of each motion (s)."""


def list_models() -> dict[str, Any]:
    """Return functions that create models, by name, for models that exist in every clone.

    Built-in models come first, then one joint of each kind, then every force on a chain of bodies.
    """
    made: dict[str, Any] = {"walker": furthest_walker, "jumper": jumper}
    joints = ROOT / "fixtures/kinematics/mixed_joint_tree.osim"
    made["joints"] = lambda: osimlite.read(joints)
    for name, make in FORCES.items():
        made[name] = partial(with_force, make)
    return made


def list_shared_models() -> dict[str, Any]:
    """Return functions that read the models of the shared folder, by name; an empty dictionary without it."""
    shared = next(
        (
            folder
            for folder in (ROOT.parent / "shared", ROOT.parents[1] / "shared")
            if folder.is_dir()
        ),
        None,
    )
    files = sorted(shared.glob("corpus/models/*/*.osim")) if shared is not None else []
    return {
        file.parent.name + "/" + file.stem: lambda file=file: osimlite.read(file) for file in files
    }


def load_kernels(path: str) -> None:
    """Make osimlite use the kernels of a library."""
    library = ctypes.CDLL(path)
    names = json.loads(Path(path).with_suffix(".json").read_text(encoding="utf-8"))
    machine_code.use_addresses(
        {
            name: ctypes.cast(getattr(library, symbol), ctypes.c_void_p).value or 0
            for name, symbol in names.items()
        }
    )


def describe(*arrays: Any) -> str:
    """Return a digest of arrays; all NaN count as equal."""
    parts = [
        np.where(np.isnan(array), np.nan, array).tobytes() for array in map(np.asarray, arrays)
    ]
    return hashlib.sha256(b"".join(parts)).hexdigest()[:16]


def run(model: Any) -> str:
    """Return a digest of two motions of a model."""
    engine: Any = Simulation(model, "compiled", skip_unsupported=True).engine
    start = np.array(engine.get_derivative())
    starts = np.tile(start, (2, 1))
    moving = 2 * len(engine.order)
    starts[:, :moving] += np.random.default_rng(0).uniform(-0.01, 0.01, (2, moving))
    result = run_many(engine, starts, DURATION, accuracy=1e-4, threads=1)
    return describe(result.states, result.counts)


def differentiate(model: Any) -> str:
    """Return a digest of the state derivative of a model and of its Jacobians."""
    made = osimlite.tangents(model)
    controls = np.random.default_rng(1).uniform(0.05, 0.95, len(made.controls))
    return describe(*made.linear(0.1, made.x, controls))


def collect(action: Any, count: int) -> dict[str, str]:
    """Return the digests of `count` models, and of half as many from the shared folder.

    Args:
        action: function that computes the digest of a model.
        count: number of models, without those of the shared folder.

    Returns:
        Digests by name of the model; models that raise an error are left out.
    """
    found: dict[str, str] = {}
    for models, limit in ((list_models(), count), (list_shared_models(), count + count // 2)):
        for name, make in models.items():
            if len(found) >= limit:
                break
            try:
                found[name] = action(make())
            except osimlite.OsimliteError:
                continue
    return found


if __name__ == "__main__":
    if sys.argv[1] != "-":
        load_kernels(sys.argv[1])
    motions, models = map(int, sys.argv[2:])
    print(
        json.dumps({"motions": collect(run, motions), "tangents": collect(differentiate, models)})
    )
