"""Results as a table in a file: Parquet when it is whole, and until then a file to which rows are added.

The partial file is one record after another: Arrow's schema, with the settings, then batches of
rows in the order of the runs. Each begins with its length and a checksum. Whatever has become of
the file, what comes from the first damaged record on is cut off, said, and computed again.
"""

from __future__ import annotations

import json
import logging
import os
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from hashlib import blake2b
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from osimlite.base.files import make_missing_error, open_file, replace_with
from osimlite.base.require import require
from osimlite.base.text import format_count, join_words
from osimlite.base.writing import open_to_append
from osimlite.errors import OsimliteError, SettingError
from osimlite.simulation.interrupts import defer_sigint

KEY = b"osimlite"
"""Where the settings are in the metadata of the schema, as JSON."""

ROWS_PER_GROUP = 65536
"""Of the Parquet file."""

HEAD = struct.Struct("<4sQ16s")
_MARK = b"OSB1"
"""What a record of the partial file begins with; then the length and the checksum of the rest follow."""

_log = logging.getLogger(__name__)


def _load_arrow() -> Any:
    return require("pyarrow", extra="sweep", purpose="a table of results")


def make_schema(columns: Mapping[str, str], settings: Mapping[str, Any]) -> Any:
    """Of a table: type of each column by its name ("int64", "float64" or "string"), and the settings."""
    pa = _load_arrow()
    fields = [
        pa.field(name, getattr(pa, kind)(), nullable=kind != "int64")
        for name, kind in columns.items()
    ]
    return pa.schema(fields, metadata={KEY: json.dumps(settings).encode()})


def settings_of(path: str | Path) -> dict[str, Any]:
    """The settings that a Parquet file of results was made with.

    Raises:
        MissingFileError: there is no such file.
        OsimliteError: the file is none of osimlite's results.
    """
    pq = require("pyarrow.parquet", extra="sweep", purpose="a table of results")
    if not Path(path).exists():
        raise make_missing_error(path)
    try:
        # By the stream: of a name, pyarrow thinks that what is before a colon is a protocol, and
        # that all is UTF-8.
        with open_file(path) as stream:
            return _settings_in(pq.read_schema(stream))
    except (ValueError, OSError):
        raise OsimliteError(
            "this file is not the results of a sweep; give them another name", file=str(path)
        ) from None


def _settings_in(table: Any) -> dict[str, Any]:
    """The settings in the schema of a table; ValueError (what is no Arrow is one too) if there are none."""
    try:
        result = json.loads((table.metadata or {})[KEY])
    except (KeyError, RecursionError):
        result = None
    if not isinstance(result, dict):
        raise ValueError
    return result


def describe_differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    """In what settings differ, in words."""
    result = []
    for name in {**old, **new}:
        a, b = old.get(name), new.get(name)
        if a != b:
            is_brief = (
                not isinstance(a, list | dict)
                and not isinstance(b, list | dict)
                and name != "model"
            )
            result.append(f"{name} ({a} before, {b} now)" if is_brief else name)
    return result


def protect_results(path: Path, wanted: Mapping[str, Any]) -> None:
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
    if unlike := describe_differences(before, wanted):
        raise SettingError(
            f"'{path}' has results of other settings: {join_words(unlike)}; name another place with -o, or replace them "
            "with --force"
        )


def refuse_overwrite(paths: Iterable[Path]) -> None:
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
            raise OsimliteError(
                "cannot write the file: this is a folder; name a file in it", file=str(path)
            )
        self.partial = partial_of(path)
        is_there = self.partial.exists()
        if is_there and not resume:
            raise SettingError(
                f"interrupted work is in '{self.partial}'; go on with --resume, or remove that file"
            )
        try:
            self._lock = _lock_file(self.partial)
            try:
                self.stream = open_to_append(self.partial)
                if is_there:
                    self._reopen()
                else:
                    self._write_batch(table)
            except BaseException:
                self._let_go()
                raise
        except OSError as error:
            raise OsimliteError(
                f"cannot write here: {error.strerror}", file=str(self.partial)
            ) from None

    def add(self, columns: Sequence[Any]) -> None:
        """Add rows, column by column."""
        pa = _load_arrow()
        arrays = [
            pa.array(column, field.type, from_pandas=False)
            for column, field in zip(columns, self.schema, strict=True)
        ]
        batch = pa.record_batch(arrays, schema=self.schema)
        with defer_sigint():
            try:
                self._write_batch(batch)
            except OSError as error:
                raise OsimliteError(
                    f"cannot write here: {error.strerror}; make room, then go on with --resume",
                    file=str(self.partial),
                ) from None
            self.rows += batch.num_rows

    def read(self, take: Callable[[Any], object]) -> None:
        """Give every batch that is there to a function.

        Raises:
            OsimliteError: another program has damaged the file meanwhile.
        """
        end = _read_batches(self.partial, take)
        if end < self.partial.stat().st_size:
            raise OsimliteError(
                "the file was damaged meanwhile; go on with --resume", file=str(self.partial)
            )

    def _write_batch(self, item: Any) -> None:
        body = item.serialize().to_pybytes()
        self.stream.write(HEAD.pack(_MARK, len(body), _compute_checksum(body)) + body)
        self.stream.flush()

    def finish(self) -> Path:
        """Make the Parquet file of it, which appears whole; without rows there is none."""
        if self.rows == 0:
            return self.path
        pq = require("pyarrow.parquet", extra="sweep", purpose="a table of results")
        pa = _load_arrow()
        self.stream.close()
        beside = self.path.with_name(f".{self.path.name}.{os.getpid()}")
        waiting: list[Any] = []
        try:
            with (
                beside.open("wb") as stream,
                pq.ParquetWriter(stream, self.schema, write_page_checksum=True) as writer,
            ):

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
            replace_with(beside, self.path)
        except OSError as error:
            raise OsimliteError(
                f"cannot write the file: {error.strerror or error}", file=str(self.path)
            ) from None
        finally:
            beside.unlink(missing_ok=True)
        self.partial.unlink()
        return self.path

    def close(self) -> None:
        """Let go of the file, and leave it as it is; one without rows is removed."""
        self._let_go(removing=self.rows == 0)

    def _let_go(self, *, removing: bool = False) -> None:
        with suppress(OSError, AttributeError):
            # What was lost to a full disk has been told of; and there may be no stream yet.
            self.stream.close()
        if removing:
            # Windows removes no file that is open, and others may write one as soon as the lock is
            # gone.
            self.partial.unlink(missing_ok=True)
        if self._lock.is_locked:
            with suppress(OSError):
                # Windows removes no file that is open, but the lock does so there itself.
                Path(self._lock.lock_file).unlink()
            self._lock.release()

    def _reopen(self) -> None:
        """Count what is there, and cut off what is damaged."""
        pa = _load_arrow()
        first = next(_read_records(self.partial), None)
        try:
            result = pa.ipc.read_schema(pa.py_buffer(b"" if first is None else first[0]))
            before = _settings_in(result)
        except (ValueError, OSError):
            raise SettingError(
                f"'{self.partial}' is no interrupted sweep, or is damaged at its beginning; remove it, or take another "
                "name"
            ) from None
        unlike = describe_differences(before, json.loads(self.schema.metadata[KEY]))
        if unlike or not result.equals(self.schema):
            raise SettingError(
                f"the interrupted work in '{self.partial}' has other settings: {join_words(unlike) or 'its columns'}; "
                "ask for the same as before, or remove that file"
            )
        end = _read_batches(self.partial, self._count)
        if end < self.partial.stat().st_size:
            _log.warning(
                "'%s' is damaged or cut off after the first %s; the rest is computed again",
                self.partial,
                format_count(self.rows, "run"),
            )
            os.truncate(self.partial, end)

    def _count(self, batch: Any) -> None:
        self.rows += batch.num_rows


def _lock_file(path: Path) -> Any:
    """A lock that keeps other programs from writing a file until it is released.

    Raises:
        OsimliteError: another program has it, or there can be none.
    """
    filelock = require("filelock", extra="sweep", purpose="a table of results")
    if not path.parent.is_dir():
        # The lock would make the folder.
        raise OsimliteError("cannot write here: the folder does not exist", file=str(path))
    lock = filelock.FileLock(path.with_name(f"{path.name}.lock"), thread_local=False)
    try:
        lock.acquire(blocking=False)
    except filelock.Timeout:
        raise OsimliteError(
            "this file is being written by another program; wait until it has ended", file=str(path)
        ) from None
    except NotImplementedError:
        # Not every file system knows locks.
        pass
    return lock


def _read_records(path: Path) -> Iterator[tuple[bytes, int]]:
    """The records of a partial file as far as they are whole, and where each ends."""
    with open_file(path) as stream:
        while len(head := stream.read(HEAD.size)) == HEAD.size:
            mark, length, checksum = HEAD.unpack(head)
            # A damaged length may be that of no memory.
            if mark != _MARK or length > path.stat().st_size:
                return
            body = stream.read(length)
            if len(body) < length or _compute_checksum(body) != checksum:
                return
            yield body, stream.tell()


def _compute_checksum(body: bytes) -> bytes:
    return blake2b(body, digest_size=16).digest()


def _read_batches(path: Path, take: Callable[[Any], object]) -> int:
    """Give every batch of a partial file to a function, up to the first that is damaged; where the last one ends."""
    pa = _load_arrow()
    records = _read_records(path)
    head, end = next(records)
    schema = pa.ipc.read_schema(pa.py_buffer(head))
    for body, after in records:
        take(pa.ipc.read_record_batch(pa.py_buffer(body), schema))
        end = after
    return end


class ResultTable:
    """What tells of results in a Parquet file, one row for each run; all of them are read at once."""

    def _results(self) -> Path:
        raise NotImplementedError

    def to_arrow(self) -> Any:
        """The rows as a pyarrow Table.

        Raises:
            OsimliteError: the file is damaged.
        """
        pq = require("pyarrow.parquet", extra="sweep", purpose="a table of results")
        with damage_told(self._results()), open_file(self._results()) as stream:
            return pq.read_table(stream)

    def to_frame(self) -> Any:
        """The rows as a pandas DataFrame; OsimliteError as of :meth:`to_arrow`, MissingDependency without pandas."""
        require("pandas", extra="frame", purpose="a data frame")
        table = self.to_arrow()
        return table.to_pandas().set_index(table.column_names[0])

    def to_xarray(self) -> Any:
        """The rows as an xarray Dataset over their number; errors as of :meth:`to_frame`."""
        require("xarray", extra="frame", purpose="a data set of xarray")
        return self.to_frame().to_xarray()


@contextmanager
def damage_told(path: str | Path) -> Iterator[None]:
    """An error that names the file, where Parquet is read that is damaged."""
    try:
        yield
    except (OSError, ValueError):
        raise OsimliteError(
            "the results are damaged; remove the file, and run anew", file=str(path)
        ) from None


class Range(NamedTuple):
    """The least and the largest number of a column, with the runs that have them, and the mean."""

    least: float
    run_of_least: int
    most: float
    run_of_most: int
    mean: float


def compute_ranges(path: str | Path, names: Sequence[str]) -> dict[str, Range]:
    """Ranges of columns of results; those without any number are left out."""
    pq = require("pyarrow.parquet", extra="sweep", purpose="a table of results")
    result: dict[str, Range] = {}
    counts = dict.fromkeys(names, 0)
    with (
        damage_told(path),
        open_file(path) as stream,
        pq.ParquetFile(stream, page_checksum_verification=True) as file,
    ):
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
                    float(column[low]),
                    int(numbers[low]),
                    float(column[high]),
                    int(numbers[high]),
                    float(column.mean()),
                )
                old, before = result.get(name, new), counts[name]
                counts[name] = before + len(column)
                lower = min((old, new), key=lambda item: item.least)
                upper = max((old, new), key=lambda item: item.most)
                mean = (old.mean * before + new.mean * len(column)) / counts[name]
                result[name] = Range(
                    lower.least, lower.run_of_least, upper.most, upper.run_of_most, mean
                )
    return result
