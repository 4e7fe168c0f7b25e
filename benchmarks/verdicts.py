"""Compare the verdicts of the linter with OpenSim's, on models with errors.

    python benchmarks/verdicts.py --edits 1000 [--before FOLDER]    one random edit of a model
    python benchmarks/verdicts.py --pairs 2000 [--before FOLDER]    two random edits at once
    python benchmarks/verdicts.py --faults 8000 [--before FOLDER]   two faults of the walker
    python benchmarks/verdicts.py --combinations [--shard 1/2]      all pairs of general faults

`--before` names the folder of another version of osimlite, which is compared too. A verdict of the
linter is *missed* if OpenSim 4.6 does not load or initialise the model, or computes NaN
accelerations, and the linter reports no new error. It is *false* if OpenSim loads and initialises
the model, and an error says that it does not. The models are those of `shared/corpus`.

OpenSim and the linters examine a model at the same time, in child processes. A model that OpenSim
does not finish within the time limit counts neither as missed nor as false. The last lines of the
output are counts: of trials, of each verdict of OpenSim, of trials by model, and for each version
("now", "before") of verdicts with and without new errors, and of wrong ones. `--log` writes each
wrong verdict to a file.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from itertools import chain, combinations
from pathlib import Path
from typing import Any, NamedTuple, TextIO

from _corpus import ROOT, WALKER

TIME_LIMIT = 20
"""Time that OpenSim has for one model (s)."""

# Smaller models keep the time of a trial short.
MAX_MODEL_SIZE = 400_000
"""Size of the largest model (bytes)."""

MAX_LOGGED_ERRORS = 2
"""Number of errors of a wrong verdict that are logged."""

# Rules of OSIM63 compute muscle paths and fiber lengths, which is slow and predicts no failure to
# load.
LINTER_SCRIPT = """
import json, sys
from osimlite.lint import validate

for line in sys.stdin:
    try:
        report = validate(line.rstrip("\\n"), ignore="OSIM63")
        errors = [
            [item.code, item.message, getattr(item, "consequence", None)] for item in report.errors
        ]
    except Exception as error:
        errors = [["TRACEBACK", f"{type(error).__name__}: {error}"]]
    print(json.dumps(errors), flush=True)
"""


class LinterError(NamedTuple):
    """Error that the linter reports."""

    code: str
    message: str
    consequence: str | None = None
    """What OpenSim does because of it. Old versions of the linter do not say."""


class Linter:
    """One version of the linter, in a process of its own.

    Args:
        folder: folder of that version of osimlite.
    """

    def __init__(self, folder: Path) -> None:
        # The path decides which version of osimlite the process imports.
        environment = {**os.environ, "PYTHONPATH": str(folder)}
        command = [sys.executable, "-W", "ignore", "-c", LINTER_SCRIPT]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(
            command, stdin=pipe, stdout=pipe, text=True, env=environment, cwd=folder
        )

    def send(self, path: Path) -> None:
        """Let the linter start to examine a file."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{path}\n")
        self._process.stdin.flush()

    def find_errors(self, path: Path) -> list[LinterError]:
        """Return the errors of a file."""
        self.send(path)
        return self.receive()

    def receive(self) -> list[LinterError]:
        """Return the errors of the file that was sent."""
        assert self._process.stdout is not None
        return [LinterError(*error) for error in json.loads(self._process.stdout.readline())]

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()


def answer_requests(reader: int, writer: int) -> None:
    """Load files with OpenSim, and write its verdicts, until the pipe of paths is closed.

    For each file, "initialised" is written after that step, and then "runs", "refuses" or "NaN".

    Args:
        reader: descriptor of the pipe of paths, one a line.
        writer: descriptor of the pipe of answers.
    """
    import opensim

    # OpenSim prints much, and not all of it through its logger.
    for stream in (1, 2):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
    with os.fdopen(reader) as requests:
        for path in requests:
            # The alarm ends this process, from whose status the parent sees that OpenSim hangs.
            signal.alarm(TIME_LIMIT)
            try:
                model = opensim.Model(path.rstrip("\n"))
                state = model.initSystem()
                os.write(writer, b"initialised\n")
                model.realizeAcceleration(state)
                finite = all(map(math.isfinite, state.getUDot().to_numpy()))
                verdict = "runs" if finite else "NaN"
            except RuntimeError:
                verdict = "refuses"
            signal.alarm(0)
            os.write(writer, f"{verdict}\n".encode())


class Judge:
    """OpenSim in a child process, which is replaced after a crash and after `MAX_MODELS` models."""

    # A fresh process from time to time bounds the memory of OpenSim.
    MAX_MODELS = 200

    def __init__(self) -> None:
        self._child = 0
        self._model_count = 0

    def send(self, path: Path) -> None:
        """Let OpenSim start to load a file."""
        if self._model_count == self.MAX_MODELS:
            self.close()
        if not self._child:
            self._start()
        self._model_count += 1
        self._requests.write(f"{path}\n")
        self._requests.flush()

    def receive(self) -> str:
        """Return what OpenSim does with the file: "runs", "refuses", "NaN", "fails" or "hangs"."""
        words = [self._answers.readline().strip()]
        if words == ["initialised"]:
            words.append(self._answers.readline().strip())
        if words[-1] == "":
            status = self.close()
            return "hangs" if status & 127 == signal.SIGALRM else "refuses"
        if words == ["initialised", "refuses"]:
            # The model initialises, but its accelerations cannot be computed.
            return "fails"
        return words[-1]

    def judge_file(self, path: Path) -> str:
        """Return what OpenSim does with a file, as `receive` does."""
        self.send(path)
        return self.receive()

    def close(self) -> int:
        """End the process and return its status."""
        if not self._child:
            return 0
        self._requests.close()
        self._answers.close()
        _, status = os.waitpid(self._child, 0)
        self._child = 0
        self._model_count = 0
        return status

    def _start(self) -> None:
        """Start a child process by a fork, since a new process would have to import OpenSim."""
        paths, requests = os.pipe()
        answers, results = os.pipe()
        self._child = os.fork()
        if self._child == 0:
            os.close(requests)
            os.close(answers)
            try:
                answer_requests(paths, results)
            finally:
                # The exit handlers are those of the parent, and must not run here.
                os._exit(0)
        # Otherwise the child would not see when the parent closes the pipe.
        os.close(paths)
        os.close(results)
        self._requests = os.fdopen(requests, "w")
        self._answers = os.fdopen(answers)


def read_models(shared: Path, folder: Path, names: Sequence[str] = ()) -> list[Path]:
    """Copy the models of the corpus that OpenSim runs, each into a folder with its files.

    Args:
        shared: folder that has the corpus.
        folder: parent of the folders of copies.
        names: names of the folders of the corpus to use; all if empty.

    Returns:
        Files of the copies.
    """
    result = []
    judge = Judge()
    for source in sorted((shared / "corpus" / "models").glob("*/*.osim")):
        if source.stat().st_size > MAX_MODEL_SIZE or b"<Model" not in source.read_bytes():
            continue
        if names and source.parent.name not in names:
            continue
        home = folder / source.parent.name
        shutil.copytree(source.parent, home)
        path = home / source.name
        if judge.judge_file(path) == "runs":
            result.append(path)
    judge.close()
    return result


class Trial(NamedTuple):
    """Model with one or more errors."""

    path: Path
    """File of the model without errors."""
    text: str
    """Text of the model with errors."""
    description: str
    """What was changed."""


def edit_once(text: str, draw: random.Random) -> tuple[str, str]:
    """Edit a model at random.

    Args:
        text: text of the model.
        draw: source of random numbers.

    Returns:
        Edited text, and a description of the edit.
    """
    from tests.oracle.structural_edits import Text, edits

    edit = next(edits(Text(text), draw))
    return edit.text, edit.what


def edit_models(
    texts: dict[Path, str], singles: int, pairs: int, draw: random.Random
) -> Iterator[Trial]:
    """Edit random models.

    Args:
        texts: texts of the models by file.
        singles: number of trials with one edit.
        pairs: number of trials with two edits, which follow.
        draw: source of random numbers.

    Yields:
        Trials; fewer with two edits than `pairs` if some edits cannot be combined.
    """
    paths = [*texts]
    for number in range(singles + pairs):
        path = draw.choice(paths)
        text, description = edit_once(texts[path], draw)
        if number >= singles:
            try:
                text, second_description = edit_once(text, draw)
            except (IndexError, KeyError, ValueError):
                # The first edit removed what the second one needs.
                continue
            description = f"{description}; {second_description}"
        yield Trial(path, text, description)


def combine_faults(path: Path, count: int, draw: random.Random) -> Iterator[Trial]:
    """Combine two faults of the walker whose consequences in OpenSim are known.

    Args:
        path: file of the walker.
        count: number of random pairs; all pairs if it is large enough.
        draw: source of random numbers.

    Yields:
        Trials of the pairs that can be combined.
    """
    from tests.lint.faults import FAULTS

    text = path.read_text(encoding="utf-8")
    pairs = [*combinations(FAULTS, 2)]
    if count < len(pairs):
        pairs = draw.sample(pairs, count)
    for first, second in pairs:
        try:
            changed = second.change(first.change(text)[0])[0]
        except (ValueError, AssertionError):
            # The first fault removed what the second one changes.
            continue
        yield Trial(path, changed, f"{first.name}; {second.name}")


# Small models that OpenSim runs, of many format versions.
COMBINATION_MODELS = (
    *("m0001", "m0005", "m0066", "m0072", "m0093", "m0115", "m0117", "m0134", "m0139", "m0150"),
    *("m0153", "m0166", "m0178", "m0456", "m0462", "m0466", "m0471", "m0472", "m0478", "m0483"),
)
"""Models of the corpus for all combinations of two faults."""


def combine_general_faults(texts: dict[Path, str], shard: str) -> Iterator[Trial]:
    """Apply each general fault alone to each model, and then all pairs of faults.

    Args:
        texts: texts of the models by file.
        shard: part of the combinations, for example "1/2" for every second one.

    Yields:
        Trials of the faults that change the model.
    """
    from tests.lint.general_faults import GENERAL_FAULTS

    first, count = map(int, shard.split("/"))
    for size in (1, 2):
        for path, text in texts.items():
            for faults in [*combinations(GENERAL_FAULTS, size)][first - 1 :: count]:
                changed = text
                try:
                    for fault in faults:
                        before = changed
                        changed = fault.change(changed)
                        if before == changed:
                            raise ValueError(fault.name)
                except ValueError:
                    # The model has nothing that the fault changes, or the first fault removed it.
                    continue
                yield Trial(path, changed, "; ".join(fault.name for fault in faults))


def find_new_errors(errors: list[LinterError], known: Counter[LinterError]) -> list[LinterError]:
    """Return the errors that a model has in addition to those of the unchanged model.

    Args:
        errors: errors of the changed model.
        known: errors of the unchanged model, with their numbers.
    """
    remaining = known.copy()
    new = []
    for error in errors:
        if remaining[error] > 0:
            remaining[error] -= 1
        else:
            new.append(error)
    return new


def classify_verdict(verdict: str, new_errors: list[LinterError]) -> str:
    """Return why a verdict of the linter is wrong, or an empty string if it is right.

    Args:
        verdict: what OpenSim does with the model.
        new_errors: errors that the linter reports because of the change.
    """
    if any(error.code == "TRACEBACK" for error in new_errors):
        return "traceback"
    if verdict != "runs" and not new_errors:
        return f"missed ({verdict})"
    # In these cases OpenSim has initialised the model.
    is_initialised = verdict in ("runs", "NaN", "fails")
    if is_initialised and any(error.consequence == "refuses" for error in new_errors):
        return "false"
    return ""


class VerdictComparison:
    """Comparison of verdicts on many trials.

    Args:
        linters: versions of the linter by name.
        models: files of the models without errors.
        log: file for wrong verdicts, or None.
    """

    def __init__(self, linters: dict[str, Linter], models: list[Path], log: TextIO | None) -> None:
        self.judge = Judge()
        self.linters = linters
        self.log = log
        self.counts: Counter[Any] = Counter()
        self.known = {
            name: {path: Counter(linter.find_errors(path)) for path in models}
            for name, linter in linters.items()
        }

    def compare(self, trial: Trial) -> None:
        """Count the verdicts of OpenSim and of all linters on one trial."""
        # Files of the model are in the same folder.
        edited = trial.path.with_name("edited.osim")
        edited.write_text(trial.text, encoding="utf-8")
        # All start before the first answer is read, so that they work at the same time.
        self.judge.send(edited)
        for linter in self.linters.values():
            linter.send(edited)
        errors = {name: linter.receive() for name, linter in self.linters.items()}
        verdict = self.judge.receive()
        self.counts["edits"] += 1
        self.counts["model", trial.path.parent.name] += 1
        self.counts[verdict] += 1
        if verdict == "hangs":
            return
        for name in self.linters:
            new_errors = find_new_errors(errors[name], self.known[name][trial.path])
            self.counts[name, verdict, "error" if new_errors else "no error"] += 1
            wrong = classify_verdict(verdict, new_errors)
            if wrong:
                self.counts[name, wrong] += 1
                self._write_log(f"{name} {wrong}", trial, new_errors)

    def _write_log(self, title: str, trial: Trial, errors: list[LinterError]) -> None:
        if self.log is None:
            return
        lines = [f"{title} {trial.path.parent.name}: {trial.description}"]
        lines += map(str, errors[:MAX_LOGGED_ERRORS])
        self.log.write("\n    ".join(lines) + "\n")
        # The log can be read while the comparison runs.
        self.log.flush()

    def print_counts(self) -> None:
        """Print all counts."""
        for key, count in self.counts.items():
            print(f"{key if isinstance(key, str) else ' '.join(key):30} {count:6}")

    def close(self) -> None:
        """End the child processes."""
        self.judge.close()
        for linter in self.linters.values():
            linter.close()


def create_parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--edits", type=int, default=0, help="number of trials with one edit")
    parser.add_argument("--pairs", type=int, default=0, help="number of trials with two edits")
    parser.add_argument(
        "--faults", type=int, default=0, help="number of trials with two faults of the walker"
    )
    parser.add_argument(
        "--combinations", action="store_true", help="try all combinations of general faults"
    )
    parser.add_argument(
        "--models",
        nargs="*",
        default=COMBINATION_MODELS,
        help="folders of the corpus for the combinations",
    )
    parser.add_argument("--shard", default="1/1", help="part of the combinations, for example 1/2")
    parser.add_argument("--seed", type=int, default=1, help="seed of the random numbers")
    parser.add_argument("--before", type=Path, help="folder of another version of osimlite")
    parser.add_argument(
        "--shared",
        type=Path,
        default=ROOT.parent / "shared",
        help="folder that has the corpus",
    )
    parser.add_argument("--log", type=Path, help="file for wrong verdicts")
    return parser


def main() -> None:
    """Run the comparison and print the counts."""
    options = create_parser().parse_args()
    # The edits and faults are those of the tests.
    sys.path.insert(0, str(ROOT))
    import opensim

    opensim.Logger.setLevelString("Off")
    opensim.Logger.removeFileSink()
    linters = {"now": Linter(ROOT)}
    if options.before is not None:
        linters["before"] = Linter(options.before)
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        log = None
        if options.log is not None:
            log = stack.enter_context(options.log.open("w", encoding="utf-8"))
        models = []
        if options.edits or options.pairs:
            models = read_models(options.shared, folder)
        if options.combinations:
            models = read_models(options.shared, folder, options.models)
        texts = {path: path.read_text(encoding="utf-8", errors="replace") for path in models}
        walker = folder / "walker.osim"
        shutil.copy(WALKER, walker)
        comparison = VerdictComparison(linters, [*models, walker], log)
        stack.callback(comparison.close)
        # The same seed gives the same trials, also with another version of the linter.
        draw = random.Random(options.seed)
        trials = chain(
            edit_models(texts, options.edits, options.pairs, draw),
            combine_faults(walker, options.faults, draw) if options.faults else (),
            combine_general_faults(texts, options.shard) if options.combinations else (),
        )
        for number, trial in enumerate(trials):
            if number % 50 == 0:
                print(f"{number}: {dict(comparison.counts)}", file=sys.stderr, flush=True)
            comparison.compare(trial)
        comparison.print_counts()


if __name__ == "__main__":
    main()
