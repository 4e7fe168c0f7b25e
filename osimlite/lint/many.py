"""Check many files: only changed ones, in several processes if that is worth it."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from time import time_ns

from osimlite.base.cores import count_cores
from osimlite.base.files import read_standard_input
from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import replace
from osimlite.base.writing import user_cache_folder
from osimlite.errors import MissingFileError
from osimlite.lint.cache import Cache, fingerprint_text, make_key
from osimlite.lint.config import Config
from osimlite.lint.diagnostic import Report, merge_reports
from osimlite.lint.settings import Settings, load_settings

MIN_PARALLEL_BYTES = 4_000_000
"""Bytes of models from which on further processes are started; checking takes about a second for 15 MB."""

Progress = Callable[[int, int], None]


class CheckJob(NamedTuple):
    """File to check with its configuration, and the folder for its cached report (None: no cache)."""

    file: str
    config: Config
    cache_folder: Path | None


def check_files(
    files: list[str],
    options: Config,
    *,
    cached: bool = True,
    processes: int | None = None,
    progress: Progress | None = None,
) -> Report:
    """Check files, each with the settings of its folder and the options in `options`.

    Args:
        files: paths, ``-`` for standard input.
        options: configuration with precedence over the settings of the project.
        cached: whether to take findings of unchanged files from the cache, and to cache new ones.
        processes: number of processes; by default as many as are worth starting.
        progress: function that receives the numbers of checked files and of all files.

    Returns:
        The reports of all files together.

    Raises:
        MissingFileError: a file is missing or cannot be read.
        OsimliteError: the settings are invalid.
    """
    result: dict[str, Report] = {}
    texts = SourceTexts()
    jobs: list[CheckJob] = []
    caches: dict[Path, Cache] = {}
    # The same file may be named twice, by a folder and by itself.
    for file in dict.fromkeys(files):
        settings = find_settings(file)
        config = settings.config_for(file, options)
        if file == "-":
            result[file] = _check_standard_input(config, texts)
            continue
        job = CheckJob(file, config, user_cache_folder() if cached else None)
        cached_report = None
        if job.cache_folder is not None:
            cache = caches.setdefault(job.cache_folder, Cache(job.cache_folder))
            cached_report = cache.get(file, make_key(file, config))
        if cached_report is None:
            jobs.append(job)
        else:
            result[file] = cached_report
    for count, (job, report) in enumerate(_check_jobs(jobs, processes), len(result) + 1):
        result[job.file] = report
        if progress is not None:
            progress(count, len(files))
    merged = merge_reports(result[file] for file in files)
    return replace(merged, texts=texts, checked=len(files))


class SourceTexts(dict[str, str]):
    """Texts by file, read again on access, so that a thousand models do not fill the memory."""

    def __missing__(self, file: str) -> str:
        from osimlite.io.document.source import Source

        try:
            return Source.from_file(file).text
        except MissingFileError:
            return ""


def find_settings(file: str) -> Settings:
    """Return the settings of a file; for standard input those of the working folder."""
    return load_settings(
        Path.cwd() if file in ("-", "<stdin>") else resolve_folder(os.path.dirname(file))
    )


@cache
def resolve_folder(folder: str) -> Path:
    """Return the absolute path of a folder without links."""
    return Path(folder).resolve()


def _check_jobs(jobs: list[CheckJob], processes: int | None) -> Iterator[tuple[CheckJob, Report]]:
    """Yield each job with its report, in the order of the jobs, from one or several processes."""
    if not jobs:
        return
    if processes is None:
        processes = count_processes(jobs)
    if processes < 2:
        yield from ((job, check_job(job)) for job in jobs)
        return
    import gc
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    from osimlite.lint.registry import all_rules

    # On Linux forked processes share what is loaded here.
    all_rules()
    # Objects that exist before the fork are kept out of garbage collection, which would copy their
    # pages.
    gc.freeze()
    context = multiprocessing.get_context("fork" if sys.platform == "linux" else "spawn")
    # Several files in one message to a process; not too many, so that all processes end at the same
    # time.
    chunk_size = max(1, min(16, len(jobs) // (4 * processes)))
    others = {*multiprocessing.active_children()}
    with ProcessPoolExecutor(processes, context, _ignore_interrupts) as pool:
        try:
            yield from zip(jobs, pool.map(check_job, jobs, chunksize=chunk_size), strict=True)
        except BaseException:
            # The pool would wait for the files that are being checked; reports are stored as a whole.
            for process in {*multiprocessing.active_children()} - others:
                process.terminate()
            raise


def _ignore_interrupts() -> None:
    """Ignore Ctrl-C in this process, which the main process ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def count_processes(jobs: list[CheckJob]) -> int:
    """Return the number of processes that are worth starting for the sizes of the files."""
    size = 0
    for job in jobs:
        try:
            size += os.path.getsize(job.file)
        except OSError:
            continue
    if size < MIN_PARALLEL_BYTES or len(jobs) < 2:
        return 1
    # ProcessPoolExecutor allows at most 61 processes on Windows.
    return min(count_cores(), len(jobs), 61)


def check_job(job: CheckJob) -> Report:
    """Check one file, and cache its report.

    Returns:
        The report of the file.
    """
    from osimlite.lint.engine import load_subject, run_rules
    from osimlite.lint.subject import Subject

    began = time_ns()
    subject = load_subject(job.file, job.config)
    if isinstance(subject, Subject) and job.cache_folder is not None:
        subject.cache_folder = Cache(job.cache_folder).folder
    report = run_rules(subject)
    outside_paths = subject.list_outside_paths() if job.cache_folder is not None else None
    if job.cache_folder is not None and outside_paths is not None:
        # A file that changes during the check must not count as checked.
        key = make_key(job.file, job.config)
        text = fingerprint_text(subject.data)
        Cache(job.cache_folder).store(job.file, key, text, report, outside_paths, began)
    return report


def _check_standard_input(config: Config, texts: dict[str, str]) -> Report:
    from osimlite.io.document.source import Source
    from osimlite.lint.engine import check_source

    source = Source(read_standard_input(), "<stdin>")
    texts["<stdin>"] = source.text
    return check_source(source, config)
