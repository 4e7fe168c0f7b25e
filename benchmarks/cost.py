"""What everyday actions cost, counted: Python calls, modules loaded, bytes read. No machine changes these numbers.

    python benchmarks/cost.py [WORD ...]     the table, beside the numbers that stand in cost.json; WORDs choose actions
    python benchmarks/cost.py --accept       writes cost.json; say in the commit why an action became dearer

A command is counted in a process of its own, from before the first import; a call of the library in
a process with others, the second time it is made. Byte code and machine code are there already,
results of earlier runs only where the action says so; nothing is a terminal, hashes of texts are
the same in every run.

Calls and modules of osimlite's own are one thing, those of libraries and of Python another: the
latter, and the size of byte code, are compared only where the versions are those that stand in
cost.json.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ACCEPTED = HERE / "cost.json"
TOLERANCE = 0.03
LIBRARIES = ("lxml", "numpy", "pydantic", "pydantic_core", "rapidfuzz", "rich", "scipy", "typer")
KINDS = {
    "calls": ("calls", 20, True),
    "modules": ("modules", 0, True),
    "data": ("bytes of files", 500, True),
    "code": ("bytes of byte code", 500, False),
    "library calls": ("calls in libraries and Python", 20, False),
    "library modules": ("modules of libraries and Python", 0, False),
}
"""What is counted: in words, how much of it never matters, and whether it is the same for all versions of libraries."""
DETAILED = ("calls", "data", "library calls", "library modules")
"""Kinds whose parts stand in the file, as far as they are more than 1 %."""
TOLD = 8
"""Functions and modules that are named when an action became dearer."""

COMMANDS = {
    "version": "--version",
    "help": "--help",
    "rule": "rule OSIM301",
    "build": "build dynamic-walker -o built.osim",
    "validate walker": "validate walker.osim --no-cache",
    "validate walker unchanged": "validate walker.osim",
    "validate walker with a fault": "validate faulty.osim --no-cache",
    "validate walker for programs": "validate walker.osim --no-cache --format json",
    "validate legs": "validate legs.osim --no-cache",
    "validate human": "validate human.osim --no-cache",
    "info walker": "info walker.osim",
    "info human": "info human.osim",
    "format walker": "format walker.osim --check",
    "diff legs": "diff legs.osim legs.osim",
    "urdf of walker": "translate walker.osim -o urdf",
    "mjcf of legs": "translate legs.osim --to mjcf -o mjcf",
    "simulate walker": "simulate walker.osim --engine compiled --to 0.2 -o walked",
    "simulate legs": "simulate legs.osim --engine compiled --to 0.02 -o jumped",
    "muscles of legs": "muscles legs.osim --coordinate knee_angle_r --points 5",
    "kinematics of walker": "kinematics walker.osim motion.sto -o followed",
    "inverse dynamics of walker": "inverse-dynamics walker.osim motion.sto -o found",
    "page of walker": "view walker.osim motion.sto --html page.html",
}
"""Commands, in a folder that holds the models, walker.osim with a misspelt name, and a motion of the walker."""


def calls() -> Iterator[tuple[str, Callable[[], object]]]:
    """Calls of the library, on what has been read before where a call is about a model."""
    import osimlite
    from osimlite.simulation import Simulation

    models = {name: osimlite.read(f"{name}.osim") for name in ("walker", "legs", "human")}
    walker, human = models["walker"], models["human"]
    for name in models:
        yield f"read({name})", partial(osimlite.read, f"{name}.osim")
        yield f"validate({name})", partial(osimlite.validate, f"{name}.osim")
    yield "validate(model of walker)", lambda: osimlite.validate(walker)
    yield "to_text(human)", lambda: osimlite.to_text(human)
    yield "mechanism(human)", lambda: osimlite.mechanism(human)
    paths, (q, _) = osimlite.paths(human), osimlite.mechanism(human).default_state()
    yield "moment_arms(human)", lambda: paths.moment_arms(q)
    yield "to_urdf(walker)", lambda: osimlite.to_urdf(walker)
    yield "to_mjcf(legs)", lambda: osimlite.to_mjcf(models["legs"])
    yield "simulate(walker)", lambda: osimlite.simulate(walker, to=0.2, engine="compiled")
    yield "simulate(legs)", lambda: osimlite.simulate(models["legs"], to=0.02, engine="compiled")
    simulation = Simulation(walker, "compiled")
    yield "run(walker)", lambda: simulation.run(0.2)
    simulation.close()


class Cost:
    """What an action takes.

    Attributes:
        parts: of each kind of number, what it is a sum of: functions, modules, files, packages.
        totals: the sums.
    """

    def __init__(
        self, parts: Mapping[str, Mapping[str, int]], totals: Mapping[str, int] | None = None
    ) -> None:
        self.parts = parts
        self.totals = totals or {kind: sum(parts[kind].values()) for kind in KINDS}


# ------------------------------------------------------------------------------------------------------- counting
def measured(wanted: Iterable[str] = ()) -> dict[str, Cost]:
    """Count every action, or those whose name has one of these words."""
    spec = find_spec("osimlite")
    if spec is None or spec.origin is None:
        sys.exit("osimlite is not installed here, and not on the path")
    package = Path(spec.origin).parent.as_posix()
    words = [*wanted]
    commands = {
        name: line.split()
        for name, line in COMMANDS.items()
        if not words or any(w in name for w in words)
    }
    with tempfile.TemporaryDirectory() as place, ThreadPoolExecutor(os.cpu_count()) as pool:
        folder = Path(place)
        _run([sys.executable, __file__, "--prepare"], folder, package)
        found = {
            name: pool.submit(_counts, folder, package, line) for name, line in commands.items()
        }
        called = pool.submit(_counts, folder, package, [])
        costs = {name: Cost(run.result()[""]) for name, run in found.items()}
        costs |= {name: Cost(count) for name, count in called.result().items()}
    return {
        name: cost
        for name, cost in costs.items()
        if not words or any(word in name for word in words)
    }


def prepare() -> None:
    """Write what the actions read into the working folder."""
    import osimlite
    from _cost_models import write_models

    here = Path()
    write_models(here)
    text = (here / "walker.osim").read_text(encoding="utf-8")
    (here / "faulty.osim").write_text(
        text.replace("<mass>", "<mas>", 1).replace("</mass>", "</mas>", 1), encoding="utf-8"
    )
    osimlite.simulate(osimlite.read("walker.osim"), to=0.2, engine="compiled").to_sto("motion.sto")
    # This makes the machine code, too, if none is there.
    osimlite.simulate(osimlite.read("legs.osim"), to=0.01, engine="compiled")
    for name in ("legs.osim", "human.osim"):
        osimlite.validate(name)
    subprocess.run(
        [sys.executable, "-m", "osimlite", "validate", "walker.osim"],
        check=True,
        capture_output=True,
    )


def _counts(folder: Path, package: str, words: list[str]) -> dict[str, Any]:
    """Count in a new process; again where a first process may have compiled kernels."""
    from osimlite.simulation.engines.kernel_library import load_library

    result = folder / f"{'-'.join(words).replace('/', '') or 'calls'}.json"
    path = os.pathsep.join(
        (str(HERE), Path(package).parent.as_posix(), *map(os.path.abspath, filter(None, sys.path)))
    )
    command = [sys.executable, "-S", str(HERE / "_counted.py"), str(result), path, package, *words]
    for _ in range(2 if load_library() is None else 1):
        _run(command, folder, package)
    found: dict[str, Any] = json.loads(result.read_text(encoding="utf-8"))
    return found


def _run(command: list[str], folder: Path, package: str) -> None:
    kept = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("PYTHON", "OSIMLITE", "COV_"))
    }
    path = os.pathsep.join(
        (str(Path(package).parent), *map(os.path.abspath, filter(None, sys.path)))
    )
    fixed = {
        "PYTHONHASHSEED": "0", "PYTHONPATH": path, "HOME": str(folder), "XDG_CACHE_HOME": str(folder / "cache"),
        "NO_COLOR": "1", "TERM": "dumb", "COLUMNS": "80", "LC_ALL": "C.UTF-8",
    }  # fmt: skip
    done = subprocess.run(
        command,
        cwd=folder,
        env={**kept, **fixed},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(
            f"{command} ended with {done.returncode}: {done.stderr.decode(errors='replace')}"
        )


# ------------------------------------------------------------------------------------------------------- comparing
def versions() -> dict[str, str]:
    """Of Python, and of the libraries whose calls are counted."""
    found = {"python": ".".join(map(str, sys.version_info[:2]))}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "missing"
    return found


def compared(old: Mapping[str, Cost], new: Mapping[str, Cost], *, same_versions: bool) -> list[str]:
    """What became dearer or cheaper by more than 3 %, each with the functions and modules that make the difference."""
    said = [f"{name} is not counted yet" for name in new if name not in old]
    for name, cost in new.items():
        if name not in old:
            continue
        for kind, (words, few, always) in KINDS.items():
            before, after = old[name].totals[kind], cost.totals[kind]
            change = after - before
            if abs(change) <= max(few, TOLERANCE * before) or not (always or same_versions):
                continue
            share = f"{change / before:+.1%}" if before else "new"
            lines = [
                f"{name} became {'dearer' if change > 0 else 'cheaper'}: {after:,} {words}, not {before:,} ({share})"
            ]
            parts = old[name].parts[kind], cost.parts[kind]
            lines += (
                _loaded(*parts) if kind == "modules" else _where(*parts, 1 if change > 0 else -1)
            )
            said.append("\n".join(lines))
    return said


def _where(old: Mapping[str, int], new: Mapping[str, int], sign: int) -> Iterator[str]:
    """The parts that changed most in the direction of the whole."""
    folded, most = _folded(new, old) if "others" in old else (new, {})
    changes = Counter(
        {name: sign * (folded.get(name, 0) - old.get(name, 0)) for name in {**old, **folded}}
    )
    for name, change in changes.most_common(TOLD):
        if change > 0:
            which = f" (most in {most[name]})" if name in most else ""
            yield f"    {sign * change:+,} in {name}{which}, now {folded.get(name, 0):,}"


def _loaded(old: Mapping[str, int], new: Mapping[str, int]) -> Iterator[str]:
    """The modules that are loaded now, and that are not any more."""
    for words, names in (
        ("loads", new.keys() - old.keys()),
        ("no longer loads", old.keys() - new.keys()),
    ):
        if names:
            more = f" and {len(names) - TOLD} more" if len(names) > TOLD else ""
            yield f"    {words} {', '.join(sorted(names)[:TOLD])}{more}"


def _folded(
    parts: Mapping[str, int], named: Container[str]
) -> tuple[dict[str, int], dict[str, str]]:
    """Parts with those added up that are not named, by file if that is named; and the greatest in each such sum."""
    found: dict[str, int] = {}
    most: dict[str, str] = {}
    for name, number in sorted(parts.items(), key=lambda item: -item[1]):
        if name not in named:
            file = _of_file(name)
            whole = name
            name = file if file in named else "others"
            most.setdefault(name, whole)
        found[name] = found.get(name, 0) + number
    return found, most


def _of_file(name: str) -> str:
    """What the functions of a file that are not named are together."""
    file, colon, _ = name.partition(": ")
    return f"{file}: others" if colon else "others"


def _worth_naming(parts: Mapping[str, int]) -> set[str]:
    """Functions that are more than 1 % of all, and files whose other functions are together."""
    least = 0.01 * sum(parts.values())
    large = {name for name, number in parts.items() if number > least}
    rest: Counter[str] = Counter()
    for name in parts.keys() - large:
        rest[_of_file(name)] += parts[name]
    return large | {name for name, number in rest.items() if number > least}


def accepted() -> tuple[dict[str, str], dict[str, Cost]]:
    """The versions and costs that stand in the file."""
    if not ACCEPTED.exists():
        return {}, {}
    found = json.loads(ACCEPTED.read_text(encoding="utf-8"))
    loads: dict[str, dict[str, int]] = {name: {} for name in found["totals"]}
    for actions, modules in found["modules"].items():
        for name in actions.split(" | "):
            loads[name] |= dict.fromkeys(modules.split(), 1)
    costs = {}
    for name, totals in found["totals"].items():
        parts = {kind: found["parts"][name].get(kind, {}) for kind in KINDS}
        costs[name] = Cost({**parts, "modules": loads[name]}, totals)
    return found["versions"], costs


def accept(costs: Mapping[str, Cost]) -> None:
    """Write the file: the sums, what they are sums of as far as it is more than 1 %, and which actions load what."""
    parts, loads = {}, dict[str, list[str]]()
    for name, cost in costs.items():
        folded = {
            kind: _folded(cost.parts[kind], _worth_naming(cost.parts[kind]))[0] for kind in DETAILED
        }
        parts[name] = {kind: dict(sorted(table.items())) for kind, table in folded.items()}
        for module in cost.parts["modules"]:
            loads.setdefault(module, []).append(name)
    groups: dict[str, list[str]] = {}
    for module, names in sorted(loads.items()):
        groups.setdefault(" | ".join(names), []).append(module)
    tables: dict[str, dict[str, object]] = {
        "versions": {**versions()},
        "totals": {name: cost.totals for name, cost in costs.items()},
        "modules": {names: " ".join(modules) for names, modules in groups.items()},
    }
    lines = [f' "{title}": {{\n{_members(table)}\n }}' for title, table in tables.items()]
    inner = [
        f'  "{name}": {{\n'
        + ",\n".join(
            f'   "{kind}": {{\n{_members(table, 4)}\n   }}' for kind, table in kinds.items()
        )
        + "\n  }"
        for name, kinds in parts.items()
    ]
    lines.append(' "parts": {\n' + ",\n".join(inner) + "\n }")
    ACCEPTED.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


def _members(table: Mapping[str, object], depth: int = 2) -> str:
    """A JSON object with a line for each member."""
    return ",\n".join(
        f"{' ' * depth}{json.dumps(name)}: {json.dumps(value)}" for name, value in table.items()
    )


def show(costs: Mapping[str, Cost], old: Mapping[str, Cost]) -> None:
    """Print the table; behind each number by how much it differs from what is accepted."""
    print(f"{'':30}" + "".join(f"{kind:>20}" for kind in KINDS))
    for name, cost in costs.items():
        cells = []
        for kind, total in cost.totals.items():
            before = old[name].totals[kind] if name in old else 0
            share = f" {(total - before) / before:+7.1%}" if before and total != before else " " * 8
            cells.append(f"{total:>12,}{share}")
        print(f"{name:30}" + "".join(cells))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("words", nargs="*", help="count the actions whose names have one of these")
    parser.add_argument("--accept", action="store_true", help="write cost.json")
    parser.add_argument("--prepare", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.prepare:
        prepare()
        return
    costs = measured(options.words)
    known, old = accepted()
    if options.accept:
        accept({**old, **costs})
        return
    show(costs, old)
    for words in compared(old, costs, same_versions=known == versions()) if old else ():
        print(words)


if __name__ == "__main__":
    main()
