"""Results as a table in a file: Parquet when it is whole, and until then a file to which rows are added.

The partial file is a stream of Arrow's: its schema, with the settings, and one message after another, each with some
rows in the order of the runs. What a killed program leaves of a message at its end is cut off.
"""

from __future__ import annotations

import json
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from osimlite._require import require
from osimlite.errors import MissingFileError, OsimliteError, SettingError
from osimlite.text import listed

KEY = b"osimlite"
"""Where the settings are in the metadata of the schema, as JSON."""

ROWS_PER_GROUP = 65536
"""Of the Parquet file."""


@contextmanager
def undisturbed() -> Iterator[None]:
    """Put off an interruption by the keyboard until what is within is done."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    interruptions: list[object] = []
    before = signal.signal(signal.SIGINT, lambda *told: interruptions.append(told))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)
    if interruptions:
        raise KeyboardInterrupt


def _arrow() -> Any:
    return require("pyarrow", extra="sweep", purpose="a table of results")


def local(path: str | Path) -> str:
    """A path of which pyarrow does not think that what is before a colon is the name of a protocol."""
    return os.path.abspath(path)


def schema(columns: Mapping[str, str], settings: Mapping[str, Any]) -> Any:
    """Of a table: type of each column by its name ("int64", "float64" or "string"), and the settings."""
    pa = _arrow()
    fields = [pa.field(name, getattr(pa, kind)(), nullable=kind != "int64") for name, kind in columns.items()]
    return pa.schema(fields, metadata={KEY: json.dumps(settings).encode()})


def settings_of(path: str | Path) -> dict[str, Any]:
    """The settings that a Parquet file of results was made with.

    Raises:
        MissingFileError: there is no such file.
        OsimliteError: the file is none of osimlite's results.
    """
    pq = require("pyarrow.parquet", extra="sweep", purpose="a table of results")
    if not Path(path).exists():
        raise MissingFileError("cannot read the file: no such file", file=str(path))
    try:
        found: dict[str, Any] = json.loads((pq.read_schema(local(path)).metadata or {})[KEY])
    except (KeyError, ValueError):
        # What is no Parquet is an ArrowInvalid, a ValueError.
        raise OsimliteError("this file is not the results of a sweep; give them another name", file=str(path)) from None
    return found


def differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    """In what settings differ, in words."""
    found = []
    for name in {**old, **new}:
        a, b = old.get(name), new.get(name)
        if a != b:
            is_brief = not isinstance(a, list | dict) and not isinstance(b, list | dict) and name != "model"
            found.append(f"{name} ({a} before, {b} now)" if is_brief else name)
    return found


def spare(path: Path, wanted: Mapping[str, Any]) -> None:
    """Stop before finished results of other settings are lost.

    Raises:
        SettingError: there are such results.
        OsimliteError: the file is none of osimlite's results.
    """
    refuse_others(path, settings_of(path), wanted)


def refuse_others(path: Path, before: Mapping[str, Any], wanted: Mapping[str, Any]) -> None:
    """Stop where the settings of what is there are others.

    Raises:
        SettingError: they are.
    """
    if unlike := differences(before, wanted):
        raise SettingError(
            f"'{path}' has results of other settings: {listed(unlike)}; name another place with -o, or replace them "
            "with --force"
        )


def spare_strangers(paths: Iterable[Path]) -> None:
    """Stop before files are lost of which nothing says that they are results of the same command.

    Raises:
        SettingError: one of them is there.
    """
    for path in paths:
        if path.exists():
            raise SettingError(
                f"'{path}' is not from such a search; name another folder with -o, or replace it with --force"
            )


def partial_of(path: Path) -> Path:
    """Where the rows of a file are until all of them are there."""
    return path.with_name(f"{path.name}.partial")


class Partial:
    """A table that grows; close it after use.

    Args:
        path: of the Parquet file that it will be.
        table: schema of it.
        resume: go on with what is there.

    Attributes:
        rows: that are there.

    Raises:
        SettingError: there is a partial file already, or one with other settings.
        OsimliteError: it cannot be written, or another program is writing it.
    """

    def __init__(self, path: Path, table: Any, *, resume: bool = False) -> None:
        self.path, self.schema, self.rows = path, table, 0
        if path.is_dir():
            raise OsimliteError("cannot write the file: this is a folder; name a file in it", file=str(path))
        self.partial = partial_of(path)
        is_there = self.partial.exists()
        if is_there and not resume:
            raise SettingError(f"interrupted work is in '{self.partial}'; go on with --resume, or remove that file")
        try:
            self._stream = self.partial.open("ab")
            try:
                _lock(self._stream, self.partial)
                if is_there:
                    self._reopen()
                else:
                    self._stream.write(table.serialize().to_pybytes())
                    self._stream.flush()
            except BaseException:
                self._stream.close()
                raise
        except OSError as error:
            raise OsimliteError(f"cannot write here: {error.strerror}", file=str(self.partial)) from None

    def add(self, columns: Sequence[Any]) -> None:
        """Add rows, column by column."""
        pa = _arrow()
        arrays = [
            pa.array(column, field.type, from_pandas=False) for column, field in zip(columns, self.schema, strict=True)
        ]
        batch = pa.record_batch(arrays, schema=self.schema)
        with undisturbed():
            try:
                self._stream.write(batch.serialize().to_pybytes())
                self._stream.flush()
            except OSError as error:
                raise OsimliteError(
                    f"cannot write here: {error.strerror}; make room, then go on with --resume", file=str(self.partial)
                ) from None
            self.rows += batch.num_rows

    def read(self, take: Callable[[Any], object]) -> None:
        """Give every batch that is there to a function."""
        with self.partial.open("rb") as stream:
            _batches(stream, take)

    def finish(self) -> Path:
        """Make the Parquet file of it, which appears whole; without rows there is none."""
        if self.rows == 0:
            return self.path
        pq = require("pyarrow.parquet", extra="sweep", purpose="a table of results")
        pa = _arrow()
        self._stream.close()
        beside = self.path.with_name(f".{self.path.name}.{os.getpid()}")
        waiting: list[Any] = []
        try:
            with pq.ParquetWriter(local(beside), self.schema) as writer:

                def put(least: int) -> None:
                    table = pa.Table.from_batches(waiting, self.schema)
                    while table.num_rows >= least:
                        # Whatever pieces the rows came in, the file is the same.
                        writer.write_table(table.slice(0, ROWS_PER_GROUP).combine_chunks())
                        table = table.slice(ROWS_PER_GROUP)
                    waiting[:] = table.to_batches()

                def take(batch: Any) -> None:
                    waiting.append(batch)
                    if sum(item.num_rows for item in waiting) >= ROWS_PER_GROUP:
                        put(ROWS_PER_GROUP)

                self.read(take)
                put(1)
            beside.replace(self.path)
        except OSError as error:
            raise OsimliteError(f"cannot write the file: {error.strerror or error}", file=str(self.path)) from None
        finally:
            beside.unlink(missing_ok=True)
        self.partial.unlink()
        return self.path

    def close(self) -> None:
        """Let go of the file, and leave it as it is; one without rows is removed."""
        with suppress(OSError):
            # What was lost to a full disk has been told of.
            self._stream.close()
        if self.rows == 0:
            self.partial.unlink(missing_ok=True)

    def _reopen(self) -> None:
        """Count what is there, and cut off what is not whole."""
        pa = _arrow()
        with self.partial.open("rb") as stream:
            try:
                found = pa.ipc.open_stream(stream).schema
                before = json.loads(found.metadata[KEY])
            except (pa.ArrowInvalid, KeyError, TypeError, EOFError):
                raise SettingError(
                    f"'{self.partial}' is no interrupted sweep; remove it, or take another name"
                ) from None
            unlike = differences(before, json.loads(self.schema.metadata[KEY]))
            if unlike or not found.equals(self.schema):
                raise SettingError(
                    f"the interrupted work in '{self.partial}' has other settings: {listed(unlike) or 'its columns'}; "
                    "ask for the same as before, or remove that file"
                )
            stream.seek(0)
            end = _batches(stream, self._count)
        os.truncate(self.partial, end)

    def _count(self, batch: Any) -> None:
        self.rows += batch.num_rows


def _lock(stream: Any, path: Path) -> None:
    """Keep other programs from writing a file until it is closed, where the system can."""
    try:
        import fcntl
    except ImportError:
        return
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise OsimliteError(
            "this file is being written by another program; wait until it has ended", file=str(path)
        ) from None
    except OSError:
        # Not every file system knows locks.
        return


def _batches(stream: Any, take: Callable[[Any], object]) -> int:
    """Give every whole batch of a stream to a function; the place where the last one ends."""
    pa = _arrow()
    reader = pa.ipc.open_stream(stream)
    end: int = stream.tell()
    while True:
        try:
            batch = reader.read_next_batch()
        except (StopIteration, pa.ArrowInvalid, OSError):
            return end
        take(batch)
        end = stream.tell()


class Range(NamedTuple):
    """The least and the largest number of a column, with the runs that have them, and the mean."""

    least: float
    run_of_least: int
    most: float
    run_of_most: int
    mean: float


def ranges(path: str | Path, names: Sequence[str]) -> dict[str, Range]:
    """Ranges of columns of results; those without any number are left out."""
    pq = require("pyarrow.parquet", extra="sweep", purpose="a table of results")
    found: dict[str, Range] = {}
    counts = dict.fromkeys(names, 0)
    with pq.ParquetFile(local(path)) as file:
        for batch in file.iter_batches(columns=["run", *names]):
            runs = batch.column("run").to_numpy()
            for name in names:
                column = batch.column(name).to_numpy(zero_copy_only=False)
                good = np.isfinite(column)
                if not good.any():
                    continue
                column, numbers = column[good], runs[good]
                low, high = int(column.argmin()), int(column.argmax())
                new = Range(
                    float(column[low]), int(numbers[low]), float(column[high]), int(numbers[high]), float(column.mean())
                )
                old, before = found.get(name, new), counts[name]
                counts[name] = before + len(column)
                lower = min((old, new), key=lambda item: item.least)
                upper = max((old, new), key=lambda item: item.most)
                mean = (old.mean * before + new.mean * len(column)) / counts[name]
                found[name] = Range(lower.least, lower.run_of_least, upper.most, upper.run_of_most, mean)
    return found
