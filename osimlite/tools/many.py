"""Many setups in one go: side by side, each after those that make what it names, with a note of what is done."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from glob import has_magic
from hashlib import blake2b
from pathlib import Path
from typing import Any

from osimlite.base.files import read_file
from osimlite.base.records import dataclass, field
from osimlite.base.text import format_count, join_words
from osimlite.base.writing import write_into
from osimlite.errors import OsimliteError
from osimlite.io.document.cache import top_at
from osimlite.schema.model import Model
from osimlite.schema.sets import Set
from osimlite.tools.named_files import named_files
from osimlite.tools.outcome import Outcome
from osimlite.tools.patterns import find_files
from osimlite.tools.running import run, runnable

JOURNAL = ".osimlite-run.jsonl"
"""Where it is noted which setups are done, until all are: in the folder of the results, or where the program runs."""

STATUSES = DONE, NO, FAILED, WAITED = "done", "no", "failed", "not run"
"""How a setup ends: well, with the answer of its tool being no, with an error, or not at all since another failed."""

SAVE_SECONDS = 1.0


@dataclass
class Trial:
    """What became of a setup."""

    setup: str  # the file
    status: str  # see `DONE` and the others
    told: list[tuple[str, str]] = field(default_factory=list)  # names, and what is said of each
    summary: dict[str, Any] = field(default_factory=dict)  # numbers that say how it went
    files: list[str] = field(default_factory=list)  # that were written
    message: str = ""  # why it failed
    # what the check found beside errors; what has a suggestion first
    warnings: list[str] = field(default_factory=list)
    seconds: float = 0.0  # that it took
    digest: str = ""  # of the setup and all files that it names, as they were
    was_done: bool = False  # whether that was before this run


class Interrupted(OsimliteError):
    """Stopped by the keyboard; what was done is noted."""

    exit_code = 130


def found(words: Iterable[str | Path]) -> list[Path]:
    """Files of setups from names and patterns such as ``subjects/*/setup_ik.xml``, in order, none twice.

    A pattern finds no models and no sets, such as the loads or the markers that setups read.

    Raises:
        OsimliteError: a pattern matches nothing, or a folder is named.
    """
    files: dict[Path, None] = {}
    for word in map(str, words):
        if has_magic(word) and not os.path.exists(word):
            matches = find_files(word)
            setups = [
                Path(match) for match in matches if not isinstance(top_at(match), Model | Set)
            ]
            if not setups:
                raise OsimliteError(f"no {'setup' if matches else 'file'} matches '{word}'")
            files.update(dict.fromkeys(setups))
        elif os.path.isdir(word):
            raise OsimliteError(
                f"this is a folder; name the setups in it, as '{os.path.join(word, '*.xml')}'",
                file=word,
            )
        else:
            files[Path(word)] = None
    return list(files)


def run_many(
    setups: Sequence[Path],
    output: Path | None = None,
    *,
    workers: int | None = 1,
    cluster: str | None = None,
    resume: bool = False,
    progress: Callable[[int, int], object] | None = None,
    kept: dict[str | Path, Outcome] | None = None,
    overwrite: bool = False,
    write_outside: bool = False,
) -> list[Trial]:
    """Run setups; one that fails stops none but those that need what it makes.

    What they write does not depend on how many work at it.

    Args: setups: the files. output: a folder for all results, with one in it for each setup, named
        after the setup's place among them; one that names what another makes is given that from
        there. workers: processes of this machine; by default all is done in this one; None for one
        for each core. cluster: address of a Dask scheduler whose workers do it instead; they see
        the same files. resume: leave out what an earlier run has done, if its inputs and its
        results are still there unchanged. progress: called with how many are done, and of how many.
        kept: is given what came out of each setup; with one worker, in this process, only.
        overwrite: whether any file may be replaced; without it only results of the same kind are.
        write_outside: whether setups may name results outside of their project and the current
        folder.

    Returns:
        What became of each, in their order.

    Raises:
        Interrupted: by the keyboard; the rest can be done with `resume`.
        OsimliteError: the cluster cannot be reached.
    """
    journal = _Journal(output or Path(), resume, is_kept=len(setups) > 1)
    places = places_of(setups, output)
    work = _Work(setups, journal, progress)
    do = partial(_one, places, work.needs, kept, overwrite, write_outside)
    try:
        if cluster is None and workers == 1:
            for setup in work.ready():
                work.note(do(setup))
        else:
            work.share(do, workers, cluster)
    except KeyboardInterrupt:
        journal.save()
        message = f"interrupted after {len(work.trials)} of {format_count(len(setups), 'setup')}"
        raise Interrupted(f"{message}; go on with --resume") from None
    trials = [work.trials[setup] for setup in setups]
    _tell_clashes(trials)
    journal.end(trials)
    return trials


def _tell_clashes(trials: Sequence[Trial]) -> None:
    """Results over which another setup has written are no results, and whose they are now depends on chance."""
    owners: dict[str, Trial] = {}
    for trial in trials:
        for file in map(os.path.realpath, trial.files):
            other = owners.setdefault(file, trial)
            if other is not trial:
                for one, another in ((trial, other), (other, trial)):
                    one.status = FAILED
                    one.message = f"'{another.setup}' writes '{file}' too; give each a place of its own, or -o FOLDER"


def places_of(setups: Sequence[Path], output: Path | None) -> dict[Path, Path | None]:
    """A folder for the results of each setup; none if these go where the setup says."""
    if output is None or len(setups) == 1:
        return dict.fromkeys(setups, output)
    paths = [os.path.abspath(setup) for setup in setups]
    common = os.path.commonpath([os.path.dirname(path) for path in paths])
    return {
        setup: output / Path(os.path.relpath(path, common)).with_suffix("")
        for setup, path in zip(setups, paths, strict=True)
    }


def find_substitutes(
    setup: Path, needs: Sequence[Path], places: Mapping[Path, Path | None]
) -> dict[str, str]:
    """Return where files that a setup names are now, if others have made them and put them elsewhere.

    Args:
        setup: that names the files.
        needs: setups that make them.
        places: by setup, the folder of its results; None if these are where the setup says.
    """
    result = {}
    named = {os.path.realpath(name) for name in named_files(str(setup), "file")}
    for maker in needs:
        folder = places[maker]
        if folder is None:
            continue
        for path in named & {
            os.path.realpath(name) for name in named_files(str(maker), "output-file")
        }:
            new = folder / os.path.basename(path)
            if new.is_file():
                result[path] = str(new.absolute())
    return result


def _one(
    places: dict[Path, Path | None],
    needs: dict[Path, list[Path]],
    kept: dict[str | Path, Outcome] | None,
    overwrite: bool,
    write_outside: bool,
    setup: Path,
) -> Trial:
    """Run one setup; every error of its own is part of the answer."""
    started = time.perf_counter()
    try:
        digest = digest_of(setup)
        substitutes = find_substitutes(setup, needs[setup], places)
        outcome = run(
            setup,
            places[setup],
            overwrite=overwrite,
            write_outside=write_outside,
            substitutes=substitutes,
        )
    except OsimliteError as error:
        return Trial(str(setup), FAILED, message=str(error), seconds=time.perf_counter() - started)
    if kept is not None:
        kept[setup] = outcome
    return Trial(
        str(setup),
        DONE if outcome.done else NO,
        outcome.told,
        _plain(outcome.summary),
        files=[str(file) for file in outcome.files],
        warnings=[str(finding) for finding in outcome.warnings],
        seconds=time.perf_counter() - started,
        digest=digest,
    )


def _plain(summary: dict[str, Any]) -> dict[str, Any]:
    return json.loads(json.dumps(summary, default=float))


def digest_of(setup: Path) -> str:
    """Of the contents of a setup and of all files that it names."""
    made = blake2b(digest_size=16)
    for path in dict.fromkeys((str(setup), *named_files(str(setup), "file"))):
        made.update(path.encode("utf-8", "surrogateescape"))
        try:
            made.update(read_file(path))
        except OsimliteError:
            made.update(b"\0")
    return made.hexdigest()


class _Journal:
    """What is noted of the setups that are done; of one alone nothing."""

    def __init__(self, folder: Path, resume: bool, *, is_kept: bool) -> None:
        self.path, self.noted = folder / JOURNAL, dict[str, Trial]()
        self._saved, self._is_kept = time.monotonic(), is_kept
        lines: list[bytes] = []
        # Without a readable journal the work is done again.
        with suppress(OsimliteError):
            lines = read_file(self.path).splitlines() if resume else []
        for line in lines:
            if (trial := read_trial(line)) is not None:
                self.noted[trial.setup] = trial

    def done(self, setup: Path) -> Trial | None:
        """What is noted of a setup, if all is still as it was."""
        trial = self.noted.get(str(setup))
        if trial is None or trial.status not in (DONE, NO) or trial.digest != digest_of(setup):
            return None
        if not all(map(os.path.isfile, trial.files)):
            return None
        trial.was_done = True
        return trial

    def note(self, trial: Trial) -> None:
        self.noted[trial.setup] = trial
        if time.monotonic() - self._saved > SAVE_SECONDS:
            # Where nothing can be noted, as beside setups that may only be read, the work goes on
            # all the same.
            with suppress(OsimliteError):
                self.save()

    def save(self) -> None:
        """Write it, if there is anything to write."""
        self._saved = time.monotonic()
        if self._is_kept and self.noted and self.path.parent.is_dir():
            lines = (
                json.dumps({**vars(trial), "was_done": False}) for trial in self.noted.values()
            )
            write_into(self.path.parent, self.path.name, "".join(f"{line}\n" for line in lines))

    def end(self, trials: Sequence[Trial]) -> None:
        """Nothing is left to do, or something that failed may be done later."""
        with suppress(OsimliteError, OSError):
            if all(trial.status in (DONE, NO) for trial in trials):
                self.path.unlink(missing_ok=True)
            else:
                self.save()


def read_trial(line: bytes) -> Trial | None:
    """Return the trial of one line of a journal; None if the line is damaged, so that it is done again."""
    try:
        match json.loads(line):
            case {
                "setup": str(),
                "status": str(status),
                "told": [*told],
                "summary": {**_summary},
                "files": [*files],
                "message": str(),
                "warnings": [*warnings],
                "seconds": int() | float(),
                "digest": str(),
                "was_done": bool(),
            } as values if status in STATUSES:
                pairs = [(name, said) for name, said in told]
                words = (*files, *warnings, *(word for pair in pairs for word in pair))
                # Tables of many trials are sorted by this number.
                error = values["summary"].get("rms_marker_error", 0.0)
                if isinstance(error, int | float) and all(isinstance(word, str) for word in words):
                    return Trial(**{**values, "told": pairs})
    except (ValueError, TypeError, RecursionError):
        pass
    return None


class _Work:
    """Which setups can be run, and what became of others."""

    def __init__(
        self,
        setups: Sequence[Path],
        journal: _Journal,
        progress: Callable[[int, int], object] | None,
    ) -> None:
        self.setups, self.journal, self.progress = setups, journal, progress
        self.trials: dict[Path, Trial] = {}
        self.needs = _needs(setups)
        self._given: set[Path] = set()

    def ready(self) -> Iterator[Path]:
        """Setups that can be run now; those that cannot be run any more are noted."""
        moved = True
        while moved:
            moved = False
            for setup in self.setups:
                if setup in self._given or not all(one in self.trials for one in self.needs[setup]):
                    continue
                moved = True
                self._given.add(setup)
                needed = [str(one) for one in self.needs[setup]]
                broken = [
                    one for one in needed if self.trials[Path(one)].status in (FAILED, WAITED)
                ]
                if broken:
                    message = f"it needs what {join_words(broken)} should have made"
                    self.note(Trial(str(setup), WAITED, message=message))
                elif (trial := self.journal.done(setup)) is not None:
                    self.note(trial)
                else:
                    yield setup

    def note(self, trial: Trial) -> None:
        self.trials[Path(trial.setup)] = trial
        self.journal.note(trial)
        if self.progress is not None:
            self.progress(len(self.trials), len(self.setups))

    def share(self, do: Callable[[Path], Trial], workers: int | None, cluster: str | None) -> None:
        """Run setups side by side. Those that were under way when a process ended are run again, each alone."""
        from osimlite.base.pools import WorkerLostError, open_process_pool

        alone: list[Path] = []
        while len(self.trials) < len(self.setups):
            under_way: list[Path] = []
            try:
                with open_process_pool(do, workers=workers, cluster=cluster) as pool:
                    while len(self.trials) < len(self.setups):
                        while (
                            len(under_way) < 2 * pool.workers
                            and (setup := next(self.ready(), None)) is not None
                        ):
                            under_way.append(setup)
                            pool.submit(setup, setup)
                        if not under_way:
                            break
                        setup, trial = pool.result()
                        under_way.remove(setup)
                        self.note(trial)
            except WorkerLostError:
                alone = under_way
            while alone:
                setup = alone.pop(0)
                try:
                    with open_process_pool(do, workers=1) as pool:
                        pool.submit(setup, setup)
                        self.note(pool.result()[1])
                except WorkerLostError:
                    self.note(
                        Trial(
                            str(setup), FAILED, message="the process that ran it has ended, twice"
                        )
                    )


def _needs(setups: Sequence[Path]) -> dict[Path, list[Path]]:
    """Which other setups make what a setup names, by the names of files in them; never two each other's.

    Of those that cannot be run here, another program may have made it.
    """
    makers: dict[str, Path] = {}
    tools = runnable()
    for setup in setups:
        if type(top_at(str(setup))).__name__ not in tools:
            continue
        makers.update(
            (os.path.realpath(name), setup) for name in named_files(str(setup), "output-file")
        )
    needs: dict[Path, list[Path]] = {}
    for setup in setups:
        names = {os.path.realpath(name) for name in named_files(str(setup), "file")}
        needs[setup] = list(
            {makers[name]: None for name in sorted(names & makers.keys()) if makers[name] != setup}
        )
    # What goes round in a circle is run in the order that was given.
    done: set[Path] = set()
    while len(done) < len(setups):
        free = [setup for setup in setups if setup not in done and done.issuperset(needs[setup])]
        if not free:
            stuck = next(setup for setup in setups if setup not in done)
            needs[stuck] = [one for one in needs[stuck] if one in done]
            free = [stuck]
        done.update(free)
    return needs
