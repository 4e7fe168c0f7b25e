"""Check and time the CasADi functions of models: values, Jacobians and Hessians.

    python benchmarks/derivatives.py [--opensim] FILE.osim ...

A row is printed for each model, with these columns:

- kind of the expressions (SX or MX) and number of states;
- instructions in the function of the state derivative, and time to make it (s);
- largest errors of the state derivative, of its Jacobian, and of the Hessian of a random
  combination, at random states and controls. They are compared with the kernels, which compute
  derivatives with dual numbers (`tests/derivatives/jets.py`), relative to the size of the terms of
  each number;
- processor time (us) of the state derivative by machine code, and of the CasADi functions of value,
  Jacobian and Hessian.

With --opensim the time of OpenSim's value follows, and of a Jacobian by forward differences (us).
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from _corpus import ROOT
from _pair import run_script

STATE_COUNT = 3
"""Number of random states at which errors are measured."""

STATE_CHANGE = 0.03
"""Size of the random changes of coordinates (rad, m)."""

MAX_HESSIAN_STATES = 130
"""Number of states above which no Hessian is timed: making it takes too long."""

TIME_LIMIT_S = 240
"""Time limit of a model (s)."""

MEASURE_TIME_S = 0.3
"""Processor time (s) for which a function is called again and again."""

OPENSIM_SCRIPT = """
import sys, time, opensim
opensim.Logger.setLevelString("Off")
model = opensim.Model(sys.argv[1])
state = model.initSystem()
y = state.getY()
def value():
    state.setY(y)
    model.realizeAcceleration(state)
value()
start, count = time.process_time(), 0
while time.process_time() - start < 1.0:
    value()
    count += 1
print(1e6 * (time.process_time() - start) / count, state.getNY())
"""
"""Program that prints the time of OpenSim's state derivative (us) and the number of states."""

HEADINGS = (
    "model",
    "kind",
    "states",
    "instr.",
    "made, s",
    "value",
    "Jacobian",
    "Hessian",
    "code, us",
    "val., us",
    "Jac., us",
    "Hes., us",
)

ERROR_KEYS = ("value", "jacobian", "hessian")

TIME_KEYS = ("machine code", "casadi value", "casadi jacobian", "casadi hessian")


def measure_model(path: Path) -> dict[str, Any]:
    """Measure one model in this process.

    Returns:
        Kind, number of states, instructions, seconds to make the functions, errors by `ERROR_KEYS`,
        and under "times" the processor times by `TIME_KEYS` (us). The Hessian may be missing.
    """
    # A module of the tests computes the derivatives of the kernels.
    sys.path.insert(0, str(ROOT))
    import casadi
    import numpy as np

    import osimlite
    from tests.derivatives.machine import Beside

    start = time.perf_counter()
    comparison = Beside(osimlite.read(path))
    functions = comparison.functions
    dynamics = functions.dynamics
    row: dict[str, Any] = {
        "kind": "SX" if dynamics.is_a("SXFunction") else "MX",
        "states": len(functions.states),
    }
    row["seconds to make"] = time.perf_counter() - start
    row["instructions"] = dynamics.n_instructions()
    for seed in range(STATE_COUNT):
        x = comparison.state(seed, STATE_CHANGE)
        # A random state violates the constraints of the model.
        consistent = comparison.kept(x) if functions.constraint_count else x
        errors = comparison.errors(consistent, seed)
        row |= {key: max(error, row.get(key, 0.0)) for key, error in errors.items()}
    # All functions are timed at the last of the random states.
    t = comparison.t
    u = functions.u
    symbol = casadi.MX.sym("x", len(x))
    xdot = dynamics(t, symbol, u, functions.p)
    jacobian = casadi.Function("J", [symbol], [casadi.jacobian(xdot, symbol)])
    timed: dict[str, Callable[[], Any]] = {
        "machine code": lambda: comparison.derivative(x),
        "casadi value": lambda: dynamics(t, x, u, functions.p),
        "casadi jacobian": lambda: jacobian(x),
    }
    # Functions that are not expressions have no Hessian.
    if row["kind"] == "SX" and len(x) <= MAX_HESSIAN_STATES:
        weights = casadi.DM(np.random.default_rng(9).normal(size=len(x)))
        second = casadi.hessian(casadi.dot(weights, xdot), symbol)[0]
        hessian = casadi.Function("H", [symbol], [second])
        timed["casadi hessian"] = lambda: hessian(x)
    row["times"] = {name: measure_call(function) for name, function in timed.items()}
    return row


def measure_call(function: Callable[[], object]) -> float:
    """Return the mean processor time of a call (us), after a first call that does not count."""
    function()
    start = time.process_time()
    count = 0
    # Many calls, because one is shorter than the resolution of the clock.
    while time.process_time() - start < MEASURE_TIME_S:
        function()
        count += 1
    return 1e6 * (time.process_time() - start) / count


def measure_in_process(path: Path) -> tuple[dict[str, Any] | None, str]:
    """Measure one model in a process of its own, which may fail or take too long.

    Returns:
        The result of `measure_model`, or None and the reason of the failure.
    """
    command = [sys.executable, __file__, "--one", str(path)]
    try:
        process = subprocess.run(
            command, capture_output=True, text=True, check=False, timeout=TIME_LIMIT_S
        )
    except subprocess.TimeoutExpired:
        return None, f"not within {TIME_LIMIT_S} s"
    if process.returncode == 0 and process.stdout:
        # Libraries may print something before.
        return json.loads(process.stdout.splitlines()[-1]), ""
    last_line = (process.stderr.strip().splitlines() or ["?"])[-1]
    return None, last_line.rpartition("Error: ")[2][:100]


def format_row(row: dict[str, Any]) -> str:
    """Return the cells of a model behind its name."""
    cells = [
        row["kind"],
        row["states"],
        row["instructions"],
        f"{row['seconds to make']:.2f}",
        *(f"{row[key]:.1e}" if key in row else "-" for key in ERROR_KEYS),
        *(f"{row['times'][key]:.0f}" if key in row["times"] else "-" for key in TIME_KEYS),
    ]
    return "".join(f"{cell:>9}" for cell in cells)


def measure_opensim(path: Path) -> str:
    """Return the times of OpenSim in words, nothing if OpenSim fails."""
    try:
        # CasADi and OpenSim cannot be loaded in one process.
        value, size = map(float, run_script(OPENSIM_SCRIPT, str(path)).split())
    except subprocess.CalledProcessError:
        return ""
    # Forward differences need one evaluation for each state, and one at the state itself.
    return f"   OpenSim {value:.0f} us, Jacobian by differences {value * (size + 1):.0f} us"


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE.osim", help="model file")
    parser.add_argument("--opensim", action="store_true", help="time OpenSim too")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(measure_model(options.files[0])))
        return
    model_heading, *headings = HEADINGS
    print(f"{model_heading:<34}" + "".join(f"{text:>9}" for text in headings), flush=True)
    for path in options.files:
        row, reason = measure_in_process(path)
        if row is None:
            text = reason
        else:
            text = format_row(row)
            if options.opensim:
                text += measure_opensim(path)
        print(f"{path.stem[:32]:<34}{text}", flush=True)


if __name__ == "__main__":
    main()
