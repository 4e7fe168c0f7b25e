"""Functions of CasADi beside the kernels: values, Jacobians, Hessians, and what each takes.

``python benchmarks/derivatives.py FILE.osim ...`` prints a row for each model: kind of the
expressions, states, how many instructions the derivative of the state takes, seconds to make the
functions; then the largest difference, at random states and controls, of that derivative from the
kernels', of the Jacobian and of the Hessian of a random combination from those that the kernels
have themselves when they run on numbers that carry derivatives (`tests/derivatives/jets.py`), each
over the size of the numbers that it is made of; and microseconds of machine code, value, Jacobian
and Hessian. With ``--opensim`` OpenSim's value, and a Jacobian by forward differences, in
microseconds.
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

ROOT = Path(__file__).resolve().parents[1]
STATES, LARGE = 3, 130
"""How many are tried; of more states no Hessian is timed."""
PATIENCE = 240
"""S, for one model."""
OPENSIM = """
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


def measured(path: Path) -> dict[str, Any]:
    """The numbers of one model."""
    sys.path.insert(0, str(ROOT))
    import casadi
    import numpy as np

    import osimlite
    from tests.derivatives.machine import Beside

    before = time.perf_counter()
    both = Beside(osimlite.read(path))
    f = both.functions
    dynamics = f.dynamics
    row: dict[str, Any] = {
        "kind": "SX" if dynamics.is_a("SXFunction") else "MX",
        "states": len(f.states),
    }
    row["made"] = time.perf_counter() - before
    row["size"] = dynamics.n_instructions()
    for seed in range(STATES):
        x = both.state(seed, 0.03)
        found = both.errors(both.kept(x) if f.constraint_count else x, seed)
        row |= {key: max(value, row.get(key, 0.0)) for key, value in found.items()}
    u, symbol = f.u, casadi.MX.sym("x", len(x))
    xdot = dynamics(both.t, symbol, u, f.p)
    jacobian = casadi.Function("J", [symbol], [casadi.jacobian(xdot, symbol)])
    timed: dict[str, Callable[[], Any]] = {
        "machine": lambda: both.derivative(x),
        "one": lambda: dynamics(both.t, x, u, f.p),
        "all": lambda: jacobian(x),
    }
    if row["kind"] == "SX" and len(x) <= LARGE:
        push = np.random.default_rng(9).normal(size=len(x))
        hessian = casadi.Function(
            "H", [symbol], [casadi.hessian(casadi.dot(casadi.DM(push), xdot), symbol)[0]]
        )
        timed["curved"] = lambda: hessian(x)
    for name, function in timed.items():
        function()
        start, count = time.process_time(), 0
        while time.process_time() - start < 0.3:
            function()
            count += 1
        row[f"us_{name}"] = 1e6 * (time.process_time() - start) / count
    return row


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--opensim", action="store_true")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.one:
        print(json.dumps(measured(chosen.files[0])))
        return
    head = (
        "model",
        "kind",
        "states",
        "graph",
        "made s",
        "value",
        "Jacobian",
        "Hessian",
        "us code",
        "value",
        "Jac.",
        "Hess.",
    )
    print("".join(f"{text:>9}" if k else f"{text:<34}" for k, text in enumerate(head)), flush=True)
    for path in chosen.files:
        command = [sys.executable, __file__, "--one", str(path)]
        try:
            done = subprocess.run(
                command, capture_output=True, text=True, check=False, timeout=PATIENCE
            )
            said = done.stdout.splitlines()[-1] if done.returncode == 0 and done.stdout else ""
            reason = (done.stderr.strip().splitlines() or ["?"])[-1]
        except subprocess.TimeoutExpired:
            said, reason = "", f"not within {PATIENCE} s"
        name = path.stem[:32]
        if not said:
            print(f"{name:<34}{reason.rpartition('Error: ')[2][:100]}", flush=True)
            continue
        row = json.loads(said)
        cells = [row["kind"], row["states"], row["size"], f"{row['made']:.2f}"]
        cells += [
            f"{row[key]:.1e}" if key in row else "-" for key in ("value", "jacobian", "hessian")
        ]
        cells += [
            f"{row[f'us_{key}']:.0f}" if f"us_{key}" in row else "-"
            for key in ("machine", "one", "all", "curved")
        ]
        text = "".join(f"{cell:>9}" for cell in cells)
        if chosen.opensim:
            theirs = subprocess.run(
                [sys.executable, "-c", OPENSIM, str(path)],
                capture_output=True,
                text=True,
                check=False,
            )
            if theirs.returncode == 0:
                value, size = map(float, theirs.stdout.split())
                text += f"   OpenSim {value:.0f}, by differences {value * (size + 1):.0f}"
        print(f"{name:<34}{text}", flush=True)


if __name__ == "__main__":
    main()
