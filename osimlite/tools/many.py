"""Runs of many setups, in parallel and in the order of their inputs, with a journal."""

from __future__ import annotations

import json
import os
import re
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
from osimlite.io.document.cache import get_object
from osimlite.lint.project_files import is_table
from osimlite.schema.model import Model
from osimlite.schema.sets import Set
from osimlite.tools.named_files import find_named_files, find_prefixed_results
from osimlite.tools.outcome import Outcome
from osimlite.tools.patterns import find_files
from osimlite.tools.running import list_runnable, run

JOURNAL = ".osimlite-run.jsonl"
"""File in which finished runs are noted until all are finished, in the output or current folder."""

DONE = "done"
"""Status of a setup whose tool succeeded."""
NO = "no"
"""Status of a setup whose tool ran and reported a failure of its own, such as no solution."""
FAILED = "failed"
"""Status of a setup that ended with an error."""
WAITED = "not run"
"""Status of a setup that was not run because a setup that it needs failed."""
STATUSES = DONE, NO, FAILED, WAITED
"""All statuses of a setup."""

SAVE_INTERVAL_S = 1.0
"""Shortest time between two writes of the journal, s."""


@dataclass
class RunRecord:
    """Record of the run of one setup."""

    setup: str  # file of the setup
    status: str  # one of `STATUSES`
    messages: list[tuple[str, str]] = field(
        default_factory=list
    )  # subject and text of each message
    summary: dict[str, Any] = field(default_factory=dict)  # numbers that describe the result
    files: list[str] = field(default_factory=list)  # written files
    failure: str = ""  # reason of the failure
    # Findings of the check that are not errors; those with a suggestion first.
    warnings: list[str] = field(default_factory=list)
    seconds: float = 0.0  # duration
    digest: str = ""  # digest of the setup and of all files that it names
    was_done: bool = False  # whether an earlier run finished it


class RunInterruption(OsimliteError):
    """Error for a stop by the keyboard; finished runs are in the journal."""

    exit_code = 130


def find_setups(names_or_patterns: Iterable[str | Path]) -> list[Path]:
    """Return setup files by names and patterns such as ``subjects/*/setup_ik.xml``.

    Patterns skip tables, models and sets, such as the loads or the markers that setups read. No file is
    returned twice.

    Args:
        names_or_patterns: paths of setup files, or patterns of paths.

    Raises:
        OsimliteError: a pattern matches nothing, or a word names a folder.
    """
    files: dict[Path, None] = {}
    for name_or_pattern in map(str, names_or_patterns):
        # A file whose name contains a bracket is no pattern.
        if has_magic(name_or_pattern) and not os.path.exists(name_or_pattern):
            matches = find_files(name_or_pattern)
            setups = [
                Path(match)
                for match in matches
                if not is_table(match) and not isinstance(get_object(match), Model | Set)
            ]
            if not setups:
                raise OsimliteError(
                    f"the files that match '{name_or_pattern}' are models, sets and tables; name setup "
                    "files"
                    if matches
                    else f"no file matches '{name_or_pattern}'; correct the pattern, or change to the folder "
                    "of the setups"
                )
            files.update(dict.fromkeys(setups))
        elif os.path.isdir(name_or_pattern):
            raise OsimliteError(
                "expected a setup, found a folder; name the setups in it, for example "
                f"'{os.path.join(name_or_pattern, '*.xml')}'",
                file=name_or_pattern,
            )
        else:
            files[Path(name_or_pattern)] = None
    return list(files)


def run_many(
    setups: Sequence[Path],
    output: Path | None = None,
    *,
    workers: int | None = 1,
    cluster: str | None = None,
    resume: bool = False,
    progress: Callable[[int, int], object] | None = None,
    outcomes: dict[str | Path, Outcome] | None = None,
    overwrite: bool = False,
    write_outside: bool = False,
) -> list[RunRecord]:
    """Run setups; a failure stops only the setups that need its results.

    The results do not depend on the number of workers.

    Args:
        setups: paths of setup files.
        output: folder for all results, with a folder in it for each setup; a setup that names a
            result of another one reads it from there.
        workers: number of processes; 1 runs all setups in this process, None starts one for each
            core.
        cluster: address of a Dask scheduler whose workers run the setups; they must see the same
            files.
        resume: whether to skip setups that an earlier run has finished, if their inputs and results
            are unchanged.
        progress: function that receives the number of finished setups and of all setups.
        outcomes: mapping to which the outcome of each setup is added; it needs one worker in this
            process.
        overwrite: whether to replace any file; by default only results of the same kind are
            replaced.
        write_outside: whether setups may name results outside their project and the current folder.

    Returns:
        A record for each setup, in the same order.

    Raises:
        RunInterruption: the keyboard stopped the run; `resume` continues it.
        OsimliteError: the cluster cannot be reached.
    """
    journal = _Journal(output or Path(), resume, is_saved=len(setups) > 1)
    folders = assign_folders(setups, output)
    work = _Schedule(setups, journal, progress)
    do = partial(_run_one, folders, work.needs, outcomes, overwrite, write_outside)
    try:
        if cluster is None and workers == 1:
            for setup in work.yield_ready():
                work.record_run(do(setup))
        else:
            work.run_parallel(do, workers, cluster)
    except KeyboardInterrupt:
        journal.save()
        message = f"interrupted after {len(work.trials)} of {format_count(len(setups), 'setup')}"
        raise RunInterruption(f"{message}; continue with --resume") from None
    trials = [work.trials[setup] for setup in setups]
    _report_clashes(trials)
    journal.finish(trials)
    return trials


def _report_clashes(trials: Sequence[RunRecord]) -> None:
    """Mark runs as failed that wrote the same file; which one wrote last depends on chance."""
    writers: dict[str, RunRecord] = {}
    for trial in trials:
        for file in map(os.path.realpath, trial.files):
            writer = writers.setdefault(file, trial)
            if writer is not trial:
                for failed, another in ((trial, writer), (writer, trial)):
                    failed.status = FAILED
                    failed.failure = (
                        f"'{another.setup}' writes '{file}' as well; "
                        "give each setup a results folder of its own, or use -o FOLDER"
                    )


def assign_folders(setups: Sequence[Path], output: Path | None) -> dict[Path, Path | None]:
    """Assign a folder for its results to each setup.

    Args:
        setups: paths of setup files.
        output: folder for all results; None for the folders that the setups name.

    Returns:
        Folder by setup; None if the setup names the folder itself.
    """
    # A single setup writes into the folder itself.
    if output is None or len(setups) == 1:
        return dict.fromkeys(setups, output)
    paths = [os.path.abspath(setup) for setup in setups]
    # Results mirror the folders of the setups, so that equal names do not collide.
    common_folder = os.path.commonpath([os.path.dirname(path) for path in paths])
    return {
        setup: output / Path(os.path.relpath(path, common_folder)).with_suffix("")
        for setup, path in zip(setups, paths, strict=True)
    }


def find_substitutes(
    setup: Path, writers: Sequence[Path], folders: Mapping[Path, Path | None]
) -> dict[str, str]:
    """Return the present paths of inputs that other setups wrote into other folders.

    Args:
        setup: setup that names the inputs.
        writers: setups that write them.
        folders: folder of the results by setup; None if the setup names the folder itself.

    Returns:
        Present path of each input by its absolute path in the setup.
    """
    result = {}
    input_paths = {os.path.realpath(name) for name in find_named_files(str(setup), "file")}
    for writer in writers:
        folder = folders[writer]
        if folder is None:
            continue
        outputs = {os.path.realpath(name) for name in find_named_files(str(writer), "output-file")}
        prefixed = find_prefixed_results(str(writer))
        for path in input_paths:
            if path not in outputs and not _is_prefixed_result(path, prefixed):
                continue
            present_path = folder / os.path.basename(path)
            # The other setup may have failed to write this result.
            if present_path.is_file():
                result[path] = str(present_path.absolute())
    return result


def _run_one(
    folders: dict[Path, Path | None],
    needs_by_setup: dict[Path, list[Path]],
    outcomes: dict[str | Path, Outcome] | None,
    overwrite: bool,
    write_outside: bool,
    setup: Path,
) -> RunRecord:
    """Run one setup; its errors become part of the record.

    Returns:
        Record of the run: done, without a solution, or failed with the reason.
    """
    started = time.perf_counter()
    try:
        digest = compute_digest(setup)
        substitutes = find_substitutes(setup, needs_by_setup[setup], folders)
        outcome = run(
            setup,
            folders[setup],
            overwrite=overwrite,
            write_outside=write_outside,
            substitutes=substitutes,
        )
    except OsimliteError as error:
        return RunRecord(
            str(setup), FAILED, failure=str(error), seconds=time.perf_counter() - started
        )
    if outcomes is not None:
        outcomes[setup] = outcome
    return RunRecord(
        str(setup),
        DONE if outcome.done else NO,
        outcome.messages,
        _to_json_values(outcome.summary),
        files=[str(file) for file in outcome.files],
        warnings=[str(finding) for finding in outcome.warnings],
        seconds=time.perf_counter() - started,
        digest=digest,
    )


def _to_json_values(summary: dict[str, Any]) -> dict[str, Any]:
    """Return a summary with values that JSON has."""
    return json.loads(json.dumps(summary, default=float))


def compute_digest(setup: Path) -> str:
    """Return a digest of the contents of a setup and of all files that it names."""
    digest = blake2b(digest_size=16)
    # Names are part of the digest, because a setup may name another file of the same content.
    for path in dict.fromkeys((str(setup), *find_named_files(str(setup), "file"))):
        digest.update(path.encode("utf-8", "surrogateescape"))
        try:
            digest.update(read_file(path))
        except OsimliteError:
            # A missing input differs from an empty one.
            digest.update(b"\0")
    return digest.hexdigest()


class _Journal:
    """Journal of finished runs; a run of one setup has none."""

    def __init__(self, folder: Path, resume: bool, *, is_saved: bool) -> None:
        self.path = folder / JOURNAL
        self.records = dict[str, RunRecord]()
        self._saved = time.monotonic()
        self._is_saved = is_saved
        lines: list[bytes] = []
        # Without a readable journal all setups are run again.
        with suppress(OsimliteError):
            lines = read_file(self.path).splitlines() if resume else []
        for line in lines:
            if (trial := read_record(line)) is not None:
                self.records[trial.setup] = trial

    def find_finished(self, setup: Path) -> RunRecord | None:
        """Return the record of a finished run; None if its inputs or results have changed."""
        trial = self.records.get(str(setup))
        # A tool that ran and reported a failure (NO) would report it again.
        if trial is None or trial.status not in (DONE, NO) or trial.digest != compute_digest(setup):
            return None
        # Results that were deleted are to be written again.
        if not all(map(os.path.isfile, trial.files)):
            return None
        trial.was_done = True
        return trial

    def record_run(self, trial: RunRecord) -> None:
        """Add a record, and save the journal from time to time."""
        self.records[trial.setup] = trial
        if time.monotonic() - self._saved > SAVE_INTERVAL_S:
            # The runs continue if the journal cannot be written, for example in a read-only
            # folder.
            with suppress(OsimliteError):
                self.save()

    def save(self) -> None:
        """Write the journal, unless it is empty."""
        self._saved = time.monotonic()
        if self._is_saved and self.records and self.path.parent.is_dir():
            lines = (
                json.dumps({**vars(trial), "was_done": False}) for trial in self.records.values()
            )
            write_into(self.path.parent, self.path.name, "".join(f"{line}\n" for line in lines))

    def finish(self, trials: Sequence[RunRecord]) -> None:
        """Delete the journal if all runs are finished; otherwise save it for `resume`."""
        with suppress(OsimliteError, OSError):
            if all(trial.status in (DONE, NO) for trial in trials):
                self.path.unlink(missing_ok=True)
            else:
                self.save()


def read_record(line: bytes) -> RunRecord | None:
    """Return the record in one line of a journal; None if the line is damaged."""
    try:
        match json.loads(line):
            case {
                "setup": str(),
                "status": str(status),
                "messages": [*messages],
                "summary": {**_summary},
                "files": [*files],
                "failure": str(),
                "warnings": [*warnings],
                "seconds": int() | float(),
                "digest": str(),
                "was_done": bool(),
            } as values if status in STATUSES:
                pairs = [(subject, text) for subject, text in messages]
                texts = (*files, *warnings, *(text for pair in pairs for text in pair))
                # The table of all runs is sorted by this number, so it must be one.
                error = values["summary"].get("rms_marker_error", 0.0)
                if isinstance(error, int | float) and all(isinstance(text, str) for text in texts):
                    return RunRecord(**{**values, "messages": pairs})
    # A damaged line only means that its setup runs again.
    except (ValueError, TypeError, RecursionError):
        pass
    return None


class _Schedule:
    """Order of the runs, and their records."""

    def __init__(
        self,
        setups: Sequence[Path],
        journal: _Journal,
        progress: Callable[[int, int], object] | None,
    ) -> None:
        self.setups = setups
        self.journal = journal
        self.progress = progress
        self.trials: dict[Path, RunRecord] = {}
        self.needs = _find_needs(setups)
        self._scheduled: set[Path] = set()

    def yield_ready(self) -> Iterator[Path]:
        """Yield setups whose inputs exist; record setups whose inputs cannot be made."""
        has_progress = True
        while has_progress:
            has_progress = False
            for setup in self.setups:
                if setup in self._scheduled or not all(
                    need in self.trials for need in self.needs[setup]
                ):
                    continue
                has_progress = True
                self._scheduled.add(setup)
                need_names = [str(need) for need in self.needs[setup]]
                failed_needs = [
                    need
                    for need in need_names
                    if self.trials[Path(need)].status in (FAILED, WAITED)
                ]
                if failed_needs:
                    message = (
                        f"this setup needs results of {join_words(failed_needs)}, which failed"
                    )
                    self.record_run(RunRecord(str(setup), WAITED, failure=message))
                elif (trial := self.journal.find_finished(setup)) is not None:
                    self.record_run(trial)
                else:
                    yield setup

    def record_run(self, trial: RunRecord) -> None:
        """Note a record, and report progress."""
        self.trials[Path(trial.setup)] = trial
        self.journal.record_run(trial)
        if self.progress is not None:
            self.progress(len(self.trials), len(self.setups))

    def run_parallel(
        self, do: Callable[[Path], RunRecord], workers: int | None, cluster: str | None
    ) -> None:
        """Run setups in several processes.

        Setups that were running when a process died are run again, each alone.

        Args:
            do: function that runs one setup.
            workers: number of processes; None for one for each core.
            cluster: address of a Dask scheduler; None for local processes.
        """
        from osimlite.base.pools import WorkerLostError, open_process_pool

        suspects: list[Path] = []
        while len(self.trials) < len(self.setups):
            running: list[Path] = []
            try:
                with open_process_pool(do, workers=workers, cluster=cluster) as pool:
                    while len(self.trials) < len(self.setups):
                        while (
                            # Two setups for each worker: one runs while the other waits.
                            len(running) < 2 * pool.workers
                            and (setup := next(self.yield_ready(), None)) is not None
                        ):
                            running.append(setup)
                            pool.submit(setup, setup)
                        if not running:
                            break
                        setup, trial = pool.result()
                        running.remove(setup)
                        self.record_run(trial)
            except WorkerLostError:
                # One of these setups ended the process; which one is not known.
                suspects = running
            while suspects:
                setup = suspects.pop(0)
                try:
                    with open_process_pool(do, workers=1) as pool:
                        pool.submit(setup, setup)
                        self.record_run(pool.result()[1])
                except WorkerLostError:
                    self.record_run(
                        RunRecord(
                            str(setup),
                            FAILED,
                            failure="the process that ran this setup crashed twice",
                        )
                    )


def _is_prefixed_result(path: str, prefixed: tuple[str, re.Pattern[str]] | None) -> bool:
    """Return whether a real path is among the results of :func:`find_prefixed_results`."""
    folder, name = os.path.split(path)
    return (
        prefixed is not None and folder == prefixed[0] and prefixed[1].fullmatch(name) is not None
    )


def _find_needs(setups: Sequence[Path]) -> dict[Path, list[Path]]:
    """Return the setups that write the inputs of each setup.

    Setups that need each other are run in the given order. Setups of unsupported tools count as
    finished: another program may have run them.

    Returns:
        Setups that must run first, by setup; empty without any.
    """
    writers: dict[str, Path] = {}
    tools = list_runnable()
    runnable = [setup for setup in setups if type(get_object(str(setup))).__name__ in tools]
    for setup in runnable:
        writers.update(
            (os.path.realpath(name), setup) for name in find_named_files(str(setup), "output-file")
        )
    # By folder, because each input is compared with all of them.
    prefixed_by_folder: dict[str, list[tuple[Path, tuple[str, re.Pattern[str]]]]] = {}
    for setup in runnable:
        if (prefixed := find_prefixed_results(str(setup))) is not None:
            prefixed_by_folder.setdefault(prefixed[0], []).append((setup, prefixed))
    needs_by_setup: dict[Path, list[Path]] = {}
    for setup in setups:
        needs: dict[Path, None] = {}
        for name in sorted(
            {os.path.realpath(name) for name in find_named_files(str(setup), "file")}
        ):
            # Results without a property of their own are called by the name of the tool.
            writer = writers.get(name) or next(
                (
                    other
                    for other, prefixed in prefixed_by_folder.get(os.path.dirname(name), ())
                    if _is_prefixed_result(name, prefixed)
                ),
                None,
            )
            if writer is not None and writer != setup:
                needs[writer] = None
        needs_by_setup[setup] = list(needs)
    # Setups that need each other are run in the given order.
    ordered: set[Path] = set()
    while len(ordered) < len(setups):
        ready = [
            setup
            for setup in setups
            if setup not in ordered and ordered.issuperset(needs_by_setup[setup])
        ]
        if not ready:
            blocked_setup = next(setup for setup in setups if setup not in ordered)
            needs_by_setup[blocked_setup] = [
                need for need in needs_by_setup[blocked_setup] if need in ordered
            ]
            ready = [blocked_setup]
        ordered.update(ready)
    return needs_by_setup
