"""Count what everyday actions cost: Python calls, modules and bytes, which no machine changes.

    python benchmarks/cost.py [WORD ...]     print the table, for actions whose names have a WORD
    python benchmarks/cost.py --accept       write cost.json; say in the commit why costs have grown

The table has one row for each action and one column for each kind of cost. A number is followed by
its change from the accepted number in cost.json. Below the table, each change of more than 3 % is
listed with the functions and modules that cause it.

A command is counted in a process of its own, from before the first import. A call of the library is
counted at its second run, in one process with the other calls. Byte code and machine code exist
before. Caches of earlier runs exist only where the action says so. Nothing is a terminal, and
hashes of texts are the same in every run.

Calls and modules of osimlite are counted separately from those of libraries and of Python. The
latter, and the size of byte code, are compared only if Python and the libraries have the versions
of cost.json.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

HERE = Path(__file__).resolve().parent

ACCEPTED_FILE = HERE / "cost.json"
"""File with the accepted costs."""

TOLERANCE = 0.03
"""Relative change that is not reported: small changes of other code move all numbers a little."""

LIBRARIES = ("lxml", "numpy", "pydantic", "pydantic_core", "rapidfuzz", "rich", "scipy", "typer")
"""Libraries whose calls and modules are counted."""


class CostKind(NamedTuple):
    """Kind of cost, one column of the table.

    Attributes:
        unit: what is counted, in words.
        min_change: largest absolute change that is never reported.
        is_independent: whether versions of Python and of libraries do not change the number.
    """

    unit: str
    min_change: int
    is_independent: bool


KINDS = {
    "calls": CostKind("calls", 20, True),
    "modules": CostKind("modules", 0, True),
    "data": CostKind("bytes of files", 500, True),
    "code": CostKind("bytes of byte code", 500, False),
    "library calls": CostKind("calls in libraries and Python", 20, False),
    "library modules": CostKind("modules of libraries and Python", 0, False),
}
"""Kinds of cost, by name."""

DETAILED_KINDS = ("calls", "data", "library calls", "library modules")
"""Kinds whose parts of more than 1 % are written to cost.json."""

MIN_SHARE = 0.01
"""Share of the total below which cost.json does not name a part."""

MAX_LISTED = 8
"""Number of functions or modules that are listed for a change."""

OTHERS = "others"
"""Name of the sum of all parts that have no name in cost.json."""

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
"""Arguments of the commands that are counted, by name.

They run in a folder with the files of `prepare_files`: the three models, faulty.osim, which is the
walker with a misspelt tag, and motion.sto, a motion of the walker.
"""


class Cost:
    """Cost of one action.

    Attributes:
        parts: for each kind of cost the counts by function, module, file or library.
        totals: the sum of each kind.
    """

    def __init__(
        self, parts: Mapping[str, Mapping[str, int]], totals: Mapping[str, int] | None = None
    ) -> None:
        self.parts = parts
        # The file has totals of its own, because it leaves out small parts of some kinds.
        self.totals = totals or {kind: sum(parts[kind].values()) for kind in KINDS}


def make_library_calls() -> Iterator[tuple[str, Callable[[], object]]]:
    """Yield the name of each library call that is counted, and a function that makes the call.

    Calls about a model get a model that was read before, so that reading does not count.
    """
    import osimlite
    from osimlite.simulation import Simulation

    models = {name: osimlite.read(f"{name}.osim") for name in ("walker", "legs", "human")}
    walker = models["walker"]
    human = models["human"]
    for name in models:
        yield f"read({name})", partial(osimlite.read, f"{name}.osim")
        yield f"validate({name})", partial(osimlite.validate, f"{name}.osim")
    yield "validate(model of walker)", lambda: osimlite.validate(walker)
    yield "to_text(human)", lambda: osimlite.to_text(human)
    yield "mechanism(human)", lambda: osimlite.mechanism(human)
    paths = osimlite.paths(human)
    q, _ = osimlite.mechanism(human).default_state()
    yield "moment_arms(human)", lambda: paths.moment_arms(q)
    yield "to_urdf(walker)", lambda: osimlite.to_urdf(walker)
    yield "to_mjcf(legs)", lambda: osimlite.to_mjcf(models["legs"])
    yield "simulate(walker)", lambda: osimlite.simulate(walker, to=0.2, engine="compiled")
    yield "simulate(legs)", lambda: osimlite.simulate(models["legs"], to=0.02, engine="compiled")
    simulation = Simulation(walker, "compiled")
    yield "run(walker)", lambda: simulation.run(0.2)
    simulation.close()


# -------------------------------------------------------------------------------- counting
def measure_costs(words: Iterable[str] = ()) -> dict[str, Cost]:
    """Count the cost of actions.

    Args:
        words: count only actions whose names contain one of these; all actions by default.

    Returns:
        The cost of each action, by its name.
    """
    spec = find_spec("osimlite")
    if spec is None or spec.origin is None:
        sys.exit("osimlite is not installed here, and not on the import path")
    package = Path(spec.origin).parent.as_posix()
    wanted = [*words]

    def is_selected(name: str) -> bool:
        return not wanted or any(word in name for word in wanted)

    with tempfile.TemporaryDirectory() as name, ThreadPoolExecutor(os.cpu_count()) as pool:
        folder = Path(name)
        _run_process([sys.executable, __file__, "--prepare"], folder, package)
        # Processes count in parallel: the numbers do not depend on how busy the machine is.
        commands = {
            name: pool.submit(_count_process, folder, package, line.split())
            for name, line in COMMANDS.items()
            if is_selected(name)
        }
        library_calls = pool.submit(_count_process, folder, package, [])
        costs = {name: Cost(future.result()[""]) for name, future in commands.items()}
        costs |= {name: Cost(parts) for name, parts in library_calls.result().items()}
    return {name: cost for name, cost in costs.items() if is_selected(name)}


def prepare_files() -> None:
    """Write the files that the actions read into the working folder, and fill all caches."""
    import osimlite
    from _cost_models import write_models

    folder = Path()
    write_models(folder)
    text = (folder / "walker.osim").read_text(encoding="utf-8")
    faulty = text.replace("<mass>", "<mas>", 1).replace("</mass>", "</mas>", 1)
    (folder / "faulty.osim").write_text(faulty, encoding="utf-8")
    motion = osimlite.simulate(osimlite.read("walker.osim"), to=0.2, engine="compiled")
    motion.to_sto("motion.sto")
    # This compiles the machine code of muscles where the library of kernels is missing.
    osimlite.simulate(osimlite.read("legs.osim"), to=0.01, engine="compiled")
    for name in ("legs.osim", "human.osim"):
        osimlite.validate(name)
    # The command saves its result, which `validate walker unchanged` then finds.
    subprocess.run(
        [sys.executable, "-m", "osimlite", "validate", "walker.osim"],
        check=True,
        capture_output=True,
    )


def _count_process(folder: Path, package: str, words: Sequence[str]) -> dict[str, Any]:
    """Count a command, or all library calls if there are no words, in a new process.

    Args:
        folder: working folder with the files of `prepare_files`.
        package: folder of osimlite.
        words: arguments of the command.

    Returns:
        The counts of `WorkCounter.count`: of a command under the name "", of library calls by name.
    """
    from osimlite.simulation.engines.kernel_library import load_library

    result = folder / f"{'-'.join(words).replace('/', '') or 'calls'}.json"
    path = os.pathsep.join(
        (str(HERE), Path(package).parent.as_posix(), *map(os.path.abspath, filter(None, sys.path)))
    )
    command = [sys.executable, "-S", str(HERE / "_counted.py"), str(result), path, package, *words]
    # Without the library of kernels, a first process may compile kernels, which does not count.
    for _ in range(2 if load_library() is None else 1):
        _run_process(command, folder, package)
    counts: dict[str, Any] = json.loads(result.read_text(encoding="utf-8"))
    return counts


def _run_process(command: list[str], folder: Path, package: str) -> None:
    """Run a process in a folder, with an environment that is the same on all machines."""
    # Settings of Python, osimlite and coverage would change what is counted.
    inherited = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("PYTHON", "OSIMLITE", "COV_"))
    }
    path = os.pathsep.join(
        (str(Path(package).parent), *map(os.path.abspath, filter(None, sys.path)))
    )
    fixed = {
        # The order of sets of texts, and with it some calls, follows the hashes.
        "PYTHONHASHSEED": "0",
        "PYTHONPATH": path,
        "HOME": str(folder),
        "XDG_CACHE_HOME": str(folder / "cache"),
        # The width and the colours of a terminal change how text is broken and written.
        "NO_COLOR": "1",
        "TERM": "dumb",
        "COLUMNS": "80",
        "LC_ALL": "C.UTF-8",
    }
    process = subprocess.run(
        command,
        cwd=folder,
        env={**inherited, **fixed},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        check=False,
    )
    if process.returncode:
        message = process.stderr.decode(errors="replace")
        raise RuntimeError(f"{command} ended with exit code {process.returncode}: {message}")


# -------------------------------------------------------------------------------- comparing
def get_versions() -> dict[str, str]:
    """Return the versions of Python and of `LIBRARIES`.

    Returns:
        Versions by name; a library that is not installed has the version "missing".
    """
    versions = {"python": ".".join(map(str, sys.version_info[:2]))}
    for name in LIBRARIES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "missing"
    return versions


def describe_changes(
    old: Mapping[str, Cost], new: Mapping[str, Cost], *, same_versions: bool
) -> list[str]:
    """Describe all costs that have changed by more than 3 %, with the parts that cause it.

    Args:
        old: accepted costs by action.
        new: measured costs by action.
        same_versions: whether Python and the libraries have the versions of the accepted costs.
    """
    messages = [f"{name} has no accepted cost yet" for name in new if name not in old]
    for name, cost in new.items():
        if name not in old:
            continue
        for kind_name, kind in KINDS.items():
            if not (kind.is_independent or same_versions):
                continue
            before = old[name].totals[kind_name]
            after = cost.totals[kind_name]
            change = after - before
            if abs(change) <= max(kind.min_change, TOLERANCE * before):
                continue
            percent = f"{change / before:+.1%}" if before else "new"
            verb = "costs more" if change > 0 else "costs less"
            lines = [f"{name} {verb}: {after:,} {kind.unit}, before {before:,} ({percent})"]
            old_parts = old[name].parts[kind_name]
            new_parts = cost.parts[kind_name]
            if kind_name == "modules":
                lines += _describe_modules(old_parts, new_parts)
            else:
                lines += _describe_parts(old_parts, new_parts, sign=1 if change > 0 else -1)
            messages.append("\n".join(lines))
    return messages


def _describe_parts(old: Mapping[str, int], new: Mapping[str, int], sign: int) -> Iterator[str]:
    """Yield lines about the parts that have changed most in the direction of the total.

    Args:
        old: accepted parts; small ones may be summed up.
        new: measured parts, all of them.
        sign: direction of the total, 1 if it has grown and -1 if it has shrunk.
    """
    # Sums of the file are compared with the same sums of the measured parts.
    parts, largest = _sum_small_parts(new, old) if OTHERS in old else (new, {})
    changes = Counter(
        {name: sign * (parts.get(name, 0) - old.get(name, 0)) for name in {**old, **parts}}
    )
    for name, change in changes.most_common(MAX_LISTED):
        if change > 0:
            source = f" (most in {largest[name]})" if name in largest else ""
            yield f"    {sign * change:+,} in {name}{source}, now {parts.get(name, 0):,}"


def _describe_modules(old: Mapping[str, int], new: Mapping[str, int]) -> Iterator[str]:
    """Yield lines about the modules that are loaded now, and about those that no longer are."""
    loaded = new.keys() - old.keys()
    not_loaded = old.keys() - new.keys()
    for verb, names in (("loads", loaded), ("no longer loads", not_loaded)):
        if names:
            rest = f" and {len(names) - MAX_LISTED} more" if len(names) > MAX_LISTED else ""
            yield f"    {verb} {', '.join(sorted(names)[:MAX_LISTED])}{rest}"


# -------------------------------------------------------------------------------- the file
def _sum_small_parts(
    parts: Mapping[str, int], named: Container[str]
) -> tuple[dict[str, int], dict[str, str]]:
    """Sum up all parts without a name in cost.json.

    A function is added to the other functions of its file if these have a name, otherwise to all
    others.

    Args:
        parts: counts by function, file or library.
        named: names of parts and sums that cost.json has.

    Returns:
        The named parts and the sums, and for each sum the name of its largest part.
    """
    sums: dict[str, int] = {}
    largest: dict[str, str] = {}
    # In descending order, the first part of a sum is its largest.
    for name, count in sorted(parts.items(), key=lambda item: -item[1]):
        label = name
        if name not in named:
            label = _get_rest_name(name)
            if label not in named:
                label = OTHERS
            largest.setdefault(label, name)
        sums[label] = sums.get(label, 0) + count
    return sums, largest


def _get_rest_name(name: str) -> str:
    """Return the name of the sum of all functions without a name in the file of this one."""
    file, colon, _ = name.partition(": ")
    return f"{file}: {OTHERS}" if colon else OTHERS


def _find_large_parts(parts: Mapping[str, int]) -> set[str]:
    """Return the names of functions, and of rests of files, with more than 1 % of the total."""
    limit = MIN_SHARE * sum(parts.values())
    large = {name for name, count in parts.items() if count > limit}
    rests: Counter[str] = Counter()
    for name in parts.keys() - large:
        rests[_get_rest_name(name)] += parts[name]
    return large | {name for name, count in rests.items() if count > limit}


def read_accepted() -> tuple[dict[str, str], dict[str, Cost]]:
    """Read cost.json.

    Returns:
        The versions of Python and libraries, and the costs by action; both are empty if there is no
        file.
    """
    if not ACCEPTED_FILE.exists():
        return {}, {}
    content = json.loads(ACCEPTED_FILE.read_text(encoding="utf-8"))
    modules: dict[str, dict[str, int]] = {name: {} for name in content["totals"]}
    for actions, names in content["modules"].items():
        for action in actions.split(" | "):
            modules[action] |= dict.fromkeys(names.split(), 1)
    costs = {}
    for name, totals in content["totals"].items():
        parts = {kind: content["parts"][name].get(kind, {}) for kind in KINDS}
        costs[name] = Cost({**parts, "modules": modules[name]}, totals)
    return content["versions"], costs


def write_accepted(costs: Mapping[str, Cost]) -> None:
    """Write cost.json: versions, totals, parts of more than 1 %, and which actions load a module.

    Each number has a line of its own, so that a version control system shows which have changed.
    """
    parts = {}
    modules: dict[str, list[str]] = {}
    for name, cost in costs.items():
        sums = {
            kind: _sum_small_parts(cost.parts[kind], _find_large_parts(cost.parts[kind]))[0]
            for kind in DETAILED_KINDS
        }
        parts[name] = {kind: dict(sorted(table.items())) for kind, table in sums.items()}
        for module in cost.parts["modules"]:
            modules.setdefault(module, []).append(name)
    # Group modules that the same actions load: otherwise the file is ten times as long.
    groups: dict[str, list[str]] = {}
    for module, names in sorted(modules.items()):
        groups.setdefault(" | ".join(names), []).append(module)
    tables: dict[str, dict[str, object]] = {
        "versions": {**get_versions()},
        "totals": {name: cost.totals for name, cost in costs.items()},
        "modules": {actions: " ".join(names) for actions, names in groups.items()},
    }
    sections = [f' "{title}": {{\n{_format_members(table)}\n }}' for title, table in tables.items()]
    actions = []
    for name, kinds in parts.items():
        members = [
            f'   "{kind}": {{\n{_format_members(table, 4)}\n   }}' for kind, table in kinds.items()
        ]
        actions.append(f'  "{name}": {{\n' + ",\n".join(members) + "\n  }")
    sections.append(' "parts": {\n' + ",\n".join(actions) + "\n }")
    ACCEPTED_FILE.write_text("{\n" + ",\n".join(sections) + "\n}\n", encoding="utf-8")


def _format_members(table: Mapping[str, object], depth: int = 2) -> str:
    """Return the members of a JSON object with one line for each, indented by `depth` spaces."""
    return ",\n".join(
        f"{' ' * depth}{json.dumps(name)}: {json.dumps(value)}" for name, value in table.items()
    )


# -------------------------------------------------------------------------------- command
def print_costs(costs: Mapping[str, Cost], old: Mapping[str, Cost]) -> None:
    """Print the table of costs, with the relative change from the accepted cost behind each."""
    print(f"{'':30}" + "".join(f"{kind:>20}" for kind in KINDS))
    for name, cost in costs.items():
        cells = []
        for kind, total in cost.totals.items():
            before = old[name].totals[kind] if name in old else 0
            percent = " " * 8
            if before and total != before:
                percent = f" {(total - before) / before:+7.1%}"
            cells.append(f"{total:>12,}{percent}")
        print(f"{name:30}" + "".join(cells))


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "words",
        nargs="*",
        metavar="WORD",
        help="count only actions whose names contain one of these words",
    )
    parser.add_argument("--accept", action="store_true", help="write the costs to cost.json")
    parser.add_argument("--prepare", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.prepare:
        prepare_files()
        return
    costs = measure_costs(options.words)
    accepted_versions, accepted_costs = read_accepted()
    if options.accept:
        write_accepted({**accepted_costs, **costs})
        return
    print_costs(costs, accepted_costs)
    if accepted_costs:
        same_versions = accepted_versions == get_versions()
        for message in describe_changes(accepted_costs, costs, same_versions=same_versions):
            print(message)


if __name__ == "__main__":
    main()
