"""Compare the verdicts of two versions of the linter with OpenSim's, on models with faults.

    python benchmarks/verdicts.py --edits 1000 [--before FOLDER]     random edits of real models
    python benchmarks/verdicts.py --pairs 2000 [--before FOLDER]     two random edits at once
    python benchmarks/verdicts.py --faults 8000 [--before FOLDER]    two of the walker's faults at once
    python benchmarks/verdicts.py --combinations [--shard 1/2]       all pairs of faults on 20 models

`--before` names the folder of another version of osimlite, whose verdicts stand beside those of
this one. A verdict is *missed* if OpenSim 4.6 does not load or initialise the model, or computes
NaN accelerations, and the linter has no new error; it is *false* if OpenSim loads and initialises
the model and an error says that it does not. The models are those of `shared/corpus`.

OpenSim and the linters look at a model at the same time, in child processes. A model that OpenSim
does not finish within the limit of seconds counts for neither side.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import random
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import chain, combinations
from pathlib import Path
from typing import Any, NamedTuple

HERE = Path(__file__).resolve().parent
SECONDS = 20
LARGEST_BYTES = 400_000

LINTER = """
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
    """Error of a file, with what OpenSim does because of it; versions before this field claim nothing."""

    code: str
    message: str
    consequence: str | None = None


class Linter:
    """One version of osimlite, in a process of its own."""

    def __init__(self, folder: Path) -> None:
        environment = {**os.environ, "PYTHONPATH": str(folder)}
        command = [sys.executable, "-W", "ignore", "-c", LINTER]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(
            command, stdin=pipe, stdout=pipe, text=True, env=environment, cwd=folder
        )

    def send(self, path: Path) -> None:
        """Let the linter begin with a file."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{path}\n")
        self._process.stdin.flush()

    def errors(self, path: Path) -> list[LinterError]:
        """Return each error of a file."""
        self.send(path)
        return self.receive()

    def receive(self) -> list[LinterError]:
        """Return each error of the file that was sent."""
        assert self._process.stdout is not None
        return [LinterError(*error) for error in json.loads(self._process.stdout.readline())]

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()


def answer_requests(reader: int, writer: int) -> None:
    """Load the files whose paths come through a pipe with OpenSim, and write its verdicts into another.

    A line of the answer is "initialised" after that step, then "runs", "refuses", or "NaN".

    Args:
        reader: descriptor of the pipe of paths, one a line.
        writer: descriptor of the pipe of answers.
    """
    import opensim

    for stream in (1, 2):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
    with os.fdopen(reader) as requests:
        for path in requests:
            signal.alarm(SECONDS)
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
    """OpenSim in a child process, which is started again after a crash and after `MODELS` models."""

    MODELS = 200

    def __init__(self) -> None:
        self._child = self._asked = 0

    def send(self, path: Path) -> None:
        """Let OpenSim begin with a file."""
        if self._asked == self.MODELS:
            self.close()
        if not self._child:
            self._start()
        self._asked += 1
        self._requests.write(f"{path}\n")
        self._requests.flush()

    def receive(self) -> str:
        """Return what OpenSim does with the file: "runs", "refuses", "NaN", "fails", or "hangs"."""
        words = [self._answers.readline().strip()]
        if words == ["initialised"]:
            words.append(self._answers.readline().strip())
        if words[-1] == "":
            status = self.close()
            return "hangs" if status & 127 == signal.SIGALRM else "refuses"
        if words == ["initialised", "refuses"]:
            # It initialises, and fails when it is asked for accelerations.
            return "fails"
        return words[-1]

    def ask(self, path: Path) -> str:
        """Return what OpenSim does with a file."""
        self.send(path)
        return self.receive()

    def close(self) -> int:
        """End the process and return its status."""
        if not self._child:
            return 0
        self._requests.close()
        self._answers.close()
        _, status = os.waitpid(self._child, 0)
        self._child = self._asked = 0
        return status

    def _start(self) -> None:
        paths, requests = os.pipe()
        answers, results = os.pipe()
        self._child = os.fork()
        if self._child == 0:
            os.close(requests)
            os.close(answers)
            try:
                answer_requests(paths, results)
            finally:
                os._exit(0)
        os.close(paths)
        os.close(results)
        self._requests, self._answers = os.fdopen(requests, "w"), os.fdopen(answers)


def read_models(shared: Path, folder: Path, names: Sequence[str] = ()) -> list[Path]:
    """Return copies of the models of the corpus that OpenSim runs, each in a folder with its files.

    Args:
        shared: where the corpus is.
        folder: where the copies go.
        names: folders of the corpus to which it is limited; all without names.
    """
    import shutil

    result = []
    judge = Judge()
    for source in sorted((shared / "corpus" / "models").glob("*/*.osim")):
        if source.stat().st_size > LARGEST_BYTES or b"<Model" not in source.read_bytes():
            continue
        if names and source.parent.name not in names:
            continue
        home = folder / source.parent.name
        shutil.copytree(source.parent, home)
        path = home / source.name
        if judge.ask(path) == "runs":
            result.append(path)
    judge.close()
    return result


class Trial(NamedTuple):
    """A model with faults."""

    path: Path  # of the sound model
    text: str
    what: str  # the faults, for people


def edit_once(text: str, draw: random.Random) -> tuple[str, str]:
    """Return a text with one random edit, and what was done."""
    from tests.oracle.structural_edits import Text, edits

    edit = next(edits(Text(text), draw))
    return edit.text, edit.what


def edit_models(
    texts: dict[Path, str], singles: int, pairs: int, draw: random.Random
) -> Iterator[Trial]:
    """Yield models with one random edit, then others with two."""
    paths = [*texts]
    for number in range(singles + pairs):
        path = draw.choice(paths)
        text, what = edit_once(texts[path], draw)
        if number >= singles:
            try:
                text, more = edit_once(text, draw)
            except (IndexError, KeyError, ValueError):
                # The first edit has left nothing to edit.
                continue
            what = f"{what}; {more}"
        yield Trial(path, text, what)


def combine_faults(path: Path, count: int, draw: random.Random) -> Iterator[Trial]:
    """Yield the walker with two of its measured faults: all pairs, or `count` random ones."""
    from tests.lint.faults import FAULTS

    text = path.read_text(encoding="utf-8")
    pairs = [*combinations(FAULTS, 2)]
    if count < len(pairs):
        pairs = draw.sample(pairs, count)
    for first, second in pairs:
        try:
            changed = second.change(first.change(text)[0])[0]
        except (ValueError, AssertionError):
            # The first fault has taken away what the second changes.
            continue
        yield Trial(path, changed, f"{first.name}; {second.name}")


COMBINED = (
    *("m0001", "m0005", "m0066", "m0072", "m0093", "m0115", "m0117", "m0134", "m0139", "m0150"),
    *("m0153", "m0166", "m0178", "m0456", "m0462", "m0466", "m0471", "m0472", "m0478", "m0483"),
)
"""Models of the corpus for all combinations of two faults: small ones that OpenSim runs, of many versions."""


def combine_general_faults(texts: dict[Path, str], shard: str) -> Iterator[Trial]:
    """Yield each model with each general fault alone, then with all pairs: those of a shard such as "1/2"."""
    from tests.lint.general_faults import GENERAL_FAULTS

    first, count = map(int, shard.split("/"))
    for size in (1, 2):
        for path, text in texts.items():
            for faults in [*combinations(GENERAL_FAULTS, size)][first - 1 :: count]:
                changed = text
                try:
                    for fault in faults:
                        before, changed = changed, fault.change(changed)
                        if before == changed:
                            raise ValueError(fault.name)
                except ValueError:
                    # The model has nothing that the fault changes, or the first took it away.
                    continue
                yield Trial(path, changed, "; ".join(fault.name for fault in faults))


def main() -> None:
    """Run the comparison and print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--edits", type=int, default=0)
    parser.add_argument("--pairs", type=int, default=0)
    parser.add_argument("--faults", type=int, default=0)
    parser.add_argument("--combinations", action="store_true")
    parser.add_argument("--models", nargs="*", default=COMBINED, help="folders of the corpus")
    parser.add_argument("--shard", default="1/1", help="such as 1/2, of the combinations")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--before", type=Path)
    parser.add_argument("--shared", type=Path, default=HERE.parents[1] / "shared")
    parser.add_argument("--log", type=Path)
    chosen = parser.parse_args()
    sys.path.insert(0, str(HERE.parent))
    import opensim

    opensim.Logger.setLevelString("Off")
    opensim.Logger.removeFileSink()
    judge = Judge()
    linters = {"now": Linter(HERE.parent)}
    if chosen.before is not None:
        linters["before"] = Linter(chosen.before)

    draw = random.Random(chosen.seed)
    log = [] if chosen.log is None else [chosen.log.open("w", encoding="utf-8")]
    with tempfile.TemporaryDirectory() as place:
        models = []
        if chosen.edits or chosen.pairs:
            models = read_models(chosen.shared, Path(place))
        if chosen.combinations:
            models = read_models(chosen.shared, Path(place), chosen.models)
        texts = {path: path.read_text(encoding="utf-8", errors="replace") for path in models}
        walker = Path(place) / "walker.osim"
        walker.write_bytes((HERE.parent / "fixtures/walker/DynamicWalkerModel.osim").read_bytes())
        known = {
            name: {path: Counter(linter.errors(path)) for path in [*models, walker]}
            for name, linter in linters.items()
        }
        counts: Counter[Any] = Counter()
        trials = chain(
            edit_models(texts, chosen.edits, chosen.pairs, draw),
            combine_faults(walker, chosen.faults, draw) if chosen.faults else (),
            combine_general_faults(texts, chosen.shard) if chosen.combinations else (),
        )
        for number, (path, text, what) in enumerate(trials):
            if number % 50 == 0:
                print(f"{number}: {dict(counts)}", file=sys.stderr, flush=True)
            edited = path.with_name("edited.osim")
            edited.write_text(text, encoding="utf-8")
            judge.send(edited)
            for linter in linters.values():
                linter.send(edited)
            errors = {name: linter.receive() for name, linter in linters.items()}
            verdict = judge.receive()
            counts["edits"] += 1
            counts["model", path.parent.name] += 1
            counts[verdict] += 1
            if verdict == "hangs":
                continue
            for name in linters:
                left = known[name][path].copy()
                new = []
                for error in errors[name]:
                    if left[error] > 0:
                        left[error] -= 1
                    else:
                        new.append(error)
                counts[name, verdict, "error" if new else "no error"] += 1
                wrong = ""
                if any(error.code == "TRACEBACK" for error in new):
                    wrong = "traceback"
                elif verdict != "runs" and not new:
                    wrong = f"missed ({verdict})"
                elif verdict in ("runs", "NaN", "fails") and any(
                    error.consequence == "refuses" for error in new
                ):
                    wrong = "false"
                if wrong:
                    counts[name, wrong] += 1
                    for file in log:
                        lines = [f"{name} {wrong} {path.parent.name}: {what}", *map(str, new[:2])]
                        file.write("\n    ".join(lines) + "\n")
                        file.flush()
    for key, count in counts.items():
        print(f"{key if isinstance(key, str) else ' '.join(key):30} {count:6}")
    judge.close()
    for linter in linters.values():
        linter.close()


if __name__ == "__main__":
    main()
