"""Fixtures that run OpenSim in processes of its own, and that reset OpenSim's state in this process."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

_environment = dict(os.environ)
try:
    import opensim
except ImportError:
    PRISTINE: list[Any] = []
else:
    _names = opensim.ArrayStr()
    opensim.OpenSimObject.getRegisteredTypenames(_names)
    PRISTINE = [
        opensim.OpenSimObject.newInstanceOfType(_names.get(k)) for k in range(_names.getSize())
    ]
finally:
    # Importing OpenSim adds its folder to the search paths of libraries and programs in the
    # environment. Child processes would then load OpenSim's CasADi instead of their own.
    os.environ.clear()
    os.environ.update(_environment)
"""One object of each OpenSim class with OpenSim's default values.

The objects are made while tests are collected, before a file with a `<defaults>` block is read.
"""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark comparisons of Bullet with OpenSim on many models as `full`.

    The usual run covers Bullet on recorded motions in tests/simulation/.
    """
    for item in items:
        parameters = getattr(getattr(item, "callspec", None), "params", {})
        engines = [value for value in parameters.values() if isinstance(value, str)]
        if (
            item.path.name in ("test_constrained_simulation.py", "test_corpus_motions.py")
            and "bullet" in engines
        ):
            item.add_marker("full")


@pytest.fixture(scope="module", autouse=True)
def opensims_defaults() -> None:
    """Restore OpenSim's default values before each test module.

    OpenSim applies the `<defaults>` block of a file to everything that the process reads later.
    """
    for item in PRISTINE:
        opensim.OpenSimObject.registerType(item)


@pytest.fixture(scope="session", autouse=True)
def default_constants_of_smooth_muscles() -> None:
    """Compute one DeGrooteFregly2016Muscle with default time constants before all tests.

    OpenSim uses the time constants of the first muscle of this class for all others of the process.
    """
    if not PRISTINE:
        return
    model = opensim.Model()
    muscle = opensim.DeGrooteFregly2016Muscle()
    muscle.setName("muscle")
    body = opensim.Body("body", 1.0, opensim.Vec3(0.0), opensim.Inertia(1.0))
    model.addBody(body)
    model.addJoint(opensim.SliderJoint("joint", model.getGround(), body))
    muscle.addNewPathPoint("origin", model.getGround(), opensim.Vec3(0.0))
    muscle.addNewPathPoint("insertion", body, opensim.Vec3(0.2, 0.0, 0.0))
    model.addForce(muscle)
    model.realizeAcceleration(model.initSystem())


@pytest.fixture(scope="session")
def opensim_says() -> Iterator[Callable[[Path], str | None]]:
    """Return a function that asks OpenSim whether it accepts a model file.

    The function takes the path of the file. It returns None if OpenSim accepts the file, else
    OpenSim's message. All questions go to one process, see `opensim_verdicts.py`.
    """
    pytest.importorskip("opensim")
    command = [sys.executable, "-W", "ignore", str(Path(__file__).with_name("opensim_verdicts.py"))]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin is not None and process.stdout is not None

        def ask(path: Path) -> str | None:
            assert process.stdin is not None and process.stdout is not None
            process.stdin.write(f"{path}\n")
            process.stdin.flush()
            answer = json.loads(process.stdout.readline())
            assert answer is None or isinstance(answer, str)
            return answer

        yield ask
        process.stdin.close()


@pytest.fixture(scope="module")
def run_live() -> Iterator[Callable[[Path, str, str], dict[str, Any]]]:
    """Return a function that runs an OpenSim tool in another process.

    The function takes the folder, the class of the tool and its setup file. It returns how the run
    ended and the warnings of the log, see `opensim_tools.py`.
    """
    pytest.importorskip("opensim")
    command = [sys.executable, "-W", "ignore", str(Path(__file__).with_name("opensim_tools.py"))]
    pipe = subprocess.PIPE
    with subprocess.Popen(
        command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        stdin, stdout = process.stdin, process.stdout

        def ask(folder: Path, kind: str, setup: str) -> dict[str, Any]:
            stdin.write(json.dumps({"folder": str(folder), "kind": kind, "setup": setup}) + "\n")
            stdin.flush()
            for line in stdout:
                if line.startswith("{"):
                    answer: dict[str, Any] = json.loads(line)
                    return answer
            raise AssertionError("OpenSim has ended")

        yield ask
        stdin.close()
