"""Tables of results: a Parquet file when complete, and a growing partial file until then.

The partial file consists of records: Arrow's schema with the settings, then batches of rows in the
order of the runs. Each record starts with its length and a checksum. If the file is damaged, the
reader keeps the records before the first damaged one, reports it, and the rest is computed again.
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
from typing import Any

import numpy as np

from osimlite.base.files import make_missing_error, open_file, replace_with
from osimlite.base.named_tuples import NamedTuple
from osimlite.base.require import require
from osimlite.base.text import format_count, join_words
from osimlite.base.writing import open_to_append
from osimlite.errors import OsimliteError, SettingError
from osimlite.simulation.interrupts import defer_sigint

SETTINGS_KEY = b"osimlite"
"""Key of the settings (as JSON) in the metadata of the schema."""

ROWS_PER_GROUP = 65536
"""Rows per group of the Parquet file."""

RECORD_HEAD = struct.Struct("<4sQ16s")
"""Head of a record of the partial file: mark, length and checksum of the body."""
_MARK = b"OSB1"
"""First bytes of each record of the partial file."""

_log = logging.getLogger(__name__)


def _load_arrow() -> Any:
    """Return the module pyarrow, which is optional."""
    return require("pyarrow", extra="sweep", purpose="a table of results")


def make_schema(columns: Mapping[str, str], settings: Mapping[str, Any]) -> Any:
    """Return the Arrow schema of a table.

    Args:
        columns: type of each column by name: "int64", "float64" or "string".
        settings: settings, stored in the metadata.
    """
    pa = _load_arrow()
    fields = [
        # Numbers of runs are always known; measures of failed runs are missing.
        pa.field(name, getattr(pa, column_type)(), nullable=column_type != "int64")
        for name, column_type in columns.items()
    ]
    return pa.schema(fields, metadata={SETTINGS_KEY: json.dumps(settings).encode()})


def settings_of(path: str | Path) -> dict[str, Any]:
    """Return the settings with which a Parquet file of results was made.

    Args:
        path: Parquet file.

    Returns:
        Value of each setting, by name.

    Raises:
        MissingFileError: there is no such file.
        OsimliteError: the file is not a table of results.
    """  # noqa: DOC501 - a function makes the MissingFileError
    pq = require("pyarrow.parquet", extra="sweep", purpose="a table of results")
    if not Path(path).exists():
        raise make_missing_error(path)
    try:
        # A stream, because pyarrow takes a name with a colon for a URL, and assumes UTF-8.
        with open_file(path) as stream:
            return _parse_settings(pq.read_schema(stream))
    except (ValueError, OSError):
        raise OsimliteError(
            "this file does not contain results of a sweep; name another output file",
            file=str(path),
        ) from None


def _parse_settings(table: Any) -> dict[str, Any]:
    """Return the settings in a schema.

    Returns:
        Value of each setting, by name.

    Raises:
        ValueError: the schema has no settings; errors of Arrow for other files are of this class,
            too.
    """
    try:
        result = json.loads((table.metadata or {})[SETTINGS_KEY])
    except (KeyError, RecursionError):
        result = None
    if not isinstance(result, dict):
        raise ValueError
    return result


def describe_differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    """Return texts about the settings that differ.

    Args:
        old: settings of existing results.
        new: settings of the present run.
    """
    result = []
    for name in {**old, **new}:
        old_value, new_value = old.get(name), new.get(name)
        if old_value != new_value:
            # Lists, and the digest of the model, are too long for a message.
            is_brief = (
                not isinstance(old_value, list | dict)
                and not isinstance(new_value, list | dict)
                and name != "model"
            )
            result.append(f"{name} ({old_value} before, {new_value} now)" if is_brief else name)
    return result


def protect_results(path: Path, settings: Mapping[str, Any]) -> None:
    """Refuse to overwrite finished results of other settings.

    Args:
        path: Parquet file that would be overwritten.
        settings: settings of the present run.

    Raises:
        SettingError: the results have other settings.
        OsimliteError: the file is not a table of results.
    """
    refuse_other_settings(path, settings_of(path), settings)


def refuse_other_settings(
    path: Path, old_settings: Mapping[str, Any], settings: Mapping[str, Any]
) -> None:
    """Refuse settings that differ from those of existing results.

    Args:
        path: file of the results, for the message.
        old_settings: settings of the results.
        settings: settings of the present run.

    Raises:
        SettingError: the settings differ.
    """
    if differences := describe_differences(old_settings, settings):
        raise SettingError(
            f"'{path}' has results that were computed with other settings: {join_words(differences)}; name "
            "another output with -o, or replace the results with --force"
        )


def refuse_overwrite(paths: Iterable[Path]) -> None:
    """Refuse to overwrite files of unknown origin.

    Raises:
        SettingError: one of the files exists.
    """
    for path in paths:
        if path.exists():
            raise SettingError(
                f"'{path}' was not written by such a search; name another folder with -o, or replace it with --force"
            )


def get_partial_path(path: Path) -> Path:
    """Return the path of the partial file of a table."""
    return path.with_name(f"{path.name}.partial")


class PartialTable:
    """Table to which rows are added; call `close` after use.

    Args:
        path: Parquet file into which `finish` converts the table.
        table: schema of the table.
        resume: whether to continue an existing partial file.

    Attributes:
        partial: path of the partial file.
        rows: number of rows.

    Raises:
        SettingError: there is a partial file already, or it has other settings.
        OsimliteError: the file cannot be written, or another program is writing it.
    """

    def __init__(self, path: Path, table: Any, *, resume: bool = False) -> None:
        self.path, self.schema, self.rows = path, table, 0
        if path.is_dir():
            raise OsimliteError(
                "cannot write the file: this is a folder; name a file in it", file=str(path)
            )
        self.partial = get_partial_path(path)
        is_there = self.partial.exists()
        if is_there and not resume:
            raise SettingError(
                f"interrupted work is in '{self.partial}'; continue with --resume, or remove that file"
            )
        try:
            self._lock = _lock_file(self.partial)
            try:
                self.stream = open_to_append(self.partial)
                if is_there:
                    self._reopen_file()
                else:
                    # The schema is the first record, so that a resumed sweep can check its
                    # settings.
                    self._write_batch(table)
            except BaseException:
                self._release_file()
                raise
        except OSError as error:
            raise OsimliteError(
                f"cannot write here: {error.strerror}; name another output file, or correct the "
                "permissions of the folder",
                file=str(self.partial),
            ) from None

    def add(self, columns: Sequence[Any]) -> None:
        """Add rows, given as columns in the order of the schema.

        Raises:
            OsimliteError: the file cannot be written, for example because the disk is full.
        """
        pa = _load_arrow()
        arrays = [
            pa.array(column, field.type, from_pandas=False)
            for column, field in zip(columns, self.schema, strict=True)
        ]
        batch = pa.record_batch(arrays, schema=self.schema)
        # Ctrl-C in the middle of a record would leave it damaged.
        with defer_sigint():
            try:
                self._write_batch(batch)
            except OSError as error:
                raise OsimliteError(
                    f"cannot write here: {error.strerror}; free some disk space, then continue with --resume",
                    file=str(self.partial),
                ) from None
            self.rows += batch.num_rows

    def read(self, process_batch: Callable[[Any], object]) -> None:
        """Call a function with each batch of rows.

        Raises:
            OsimliteError: another program has damaged the file in the meantime.
        """
        end = _read_batches(self.partial, process_batch)
        if end < self.partial.stat().st_size:
            raise OsimliteError(
                "another program has damaged the file during the sweep; continue with --resume",
                file=str(self.partial),
            )

    def _write_batch(self, batch: Any) -> None:
        """Append a record of rows with its length and checksum."""
        body = batch.serialize().to_pybytes()
        self.stream.write(RECORD_HEAD.pack(_MARK, len(body), _compute_checksum(body)) + body)
        self.stream.flush()

    def finish(self) -> Path:
        """Convert the rows to the Parquet file, which replaces an older one in one step.

        Without rows nothing is written.

        Returns:
            Path of the Parquet file, also if nothing is written.

        Raises:
            OsimliteError: the Parquet file cannot be written.
        """
        if self.rows == 0:
            return self.path
        pq = require("pyarrow.parquet", extra="sweep", purpose="a table of results")
        pa = _load_arrow()
        self.stream.close()
        temporary = self.path.with_name(f".{self.path.name}.{os.getpid()}")
        waiting: list[Any] = []
        try:
            with (
                temporary.open("wb") as stream,
                pq.ParquetWriter(stream, self.schema, write_page_checksum=True) as writer,
            ):

                def write_groups(minimum_rows: int) -> None:
                    table = pa.Table.from_batches(waiting, self.schema)
                    while table.num_rows >= minimum_rows:
                        # Groups of fixed size make the file independent of the sizes of batches.
                        writer.write_table(table.slice(0, ROWS_PER_GROUP).combine_chunks())
                        table = table.slice(ROWS_PER_GROUP)
                    waiting[:] = table.to_batches()

                def take(batch: Any) -> None:
                    waiting.append(batch)
                    if sum(waiting_batch.num_rows for waiting_batch in waiting) >= ROWS_PER_GROUP:
                        write_groups(ROWS_PER_GROUP)

                self.read(take)
                write_groups(1)
            replace_with(temporary, self.path)
        except OSError as error:
            raise OsimliteError(
                f"cannot write the file: {error.strerror or error}", file=str(self.path)
            ) from None
        finally:
            temporary.unlink(missing_ok=True)
        self.partial.unlink()
        return self.path

    def close(self) -> None:
        """Close and unlock the partial file; it is removed if it has no rows."""
        self._release_file(removing=self.rows == 0)

    def _release_file(self, *, removing: bool = False) -> None:
        """Close the file, remove it if requested, and release the lock."""
        with suppress(OSError, AttributeError):
            # A full disk has been reported already, and there may be no stream yet.
            self.stream.close()
        if removing:
            # After `close`, because Windows does not remove open files; before the lock is released,
            # because others may then write a new file.
            self.partial.unlink(missing_ok=True)
        if self._lock.is_locked:
            with suppress(OSError):
                # Windows does not remove the open lock file; there filelock removes it itself.
                Path(self._lock.lock_file).unlink()
            self._lock.release()

    def _reopen_file(self) -> None:
        """Check the settings, count the rows, and cut off damaged records.

        Raises:
            SettingError: the file is not an interrupted sweep, its beginning is damaged, or it has
                other settings or columns.
        """
        pa = _load_arrow()
        first_record = next(_read_records(self.partial), None)
        try:
            result = pa.ipc.read_schema(
                pa.py_buffer(b"" if first_record is None else first_record[0])
            )
            old_settings = _parse_settings(result)
        except (ValueError, OSError):
            raise SettingError(
                f"'{self.partial}' is not an interrupted sweep, or its beginning is damaged; remove it, or choose another "
                "name"
            ) from None
        differences = describe_differences(
            old_settings, json.loads(self.schema.metadata[SETTINGS_KEY])
        )
        if differences or not result.equals(self.schema):
            raise SettingError(
                f"the interrupted work in '{self.partial}' has other settings: {join_words(differences) or 'its columns'}; "
                "use the settings of the interrupted sweep, or remove that file"
            )
        end = _read_batches(self.partial, self._count_rows)
        if end < self.partial.stat().st_size:
            _log.warning(
                "'%s' is damaged or cut off after the first %s; the rest is computed again",
                self.partial,
                format_count(self.rows, "run"),
            )
            # New records must follow an intact one, or they could not be read.
            os.truncate(self.partial, end)

    def _count_rows(self, batch: Any) -> None:
        """Count the rows of a record."""
        self.rows += batch.num_rows


def _lock_file(path: Path) -> Any:
    """Lock a file against other programs until the lock is released.

    Returns:
        Lock of the library filelock, which the caller releases. Where the file system supports no
        locks, it locks nothing.

    Raises:
        OsimliteError: another program has locked it, or the folder does not exist.
    """
    filelock = require("filelock", extra="sweep", purpose="a table of results")
    if not path.parent.is_dir():
        # filelock would create the folder.
        raise OsimliteError(
            "cannot write here: the folder does not exist; make it, or name another output file",
            file=str(path),
        )
    lock = filelock.FileLock(path.with_name(f"{path.name}.lock"), thread_local=False)
    try:
        lock.acquire(blocking=False)
    except filelock.Timeout:
        raise OsimliteError(
            "this file is being written by another program; wait until it has ended", file=str(path)
        ) from None
    except NotImplementedError:
        # Not every file system supports locks.
        pass
    return lock


def _read_records(path: Path) -> Iterator[tuple[bytes, int]]:
    """Yield the intact records of a partial file, with the offset after each."""
    with open_file(path) as stream:
        while len(header := stream.read(RECORD_HEAD.size)) == RECORD_HEAD.size:
            record_mark, length, checksum = RECORD_HEAD.unpack(header)
            # A damaged length could exceed the memory.
            if record_mark != _MARK or length > path.stat().st_size:
                return
            body = stream.read(length)
            if len(body) < length or _compute_checksum(body) != checksum:
                return
            yield body, stream.tell()


def _compute_checksum(body: bytes) -> bytes:
    """Return the checksum of a record (16 bytes)."""
    return blake2b(body, digest_size=16).digest()


def _read_batches(path: Path, process_batch: Callable[[Any], object]) -> int:
    """Call a function with each intact batch.

    Returns:
        Offset in the file after the last intact batch (bytes).
    """
    pa = _load_arrow()
    records = _read_records(path)
    schema_record, end = next(records)
    schema = pa.ipc.read_schema(pa.py_buffer(schema_record))
    for body, offset in records:
        process_batch(pa.ipc.read_record_batch(pa.py_buffer(body), schema))
        end = offset
    return end


class ResultTable:
    """Access to a Parquet file of results with one row per run.

    Each method reads the complete file.
    """

    def _get_results_path(self) -> Path:
        """Return the path of the Parquet file."""
        raise NotImplementedError

    def to_arrow(self) -> Any:
        """Return the rows as a pyarrow Table.

        Raises:
            OsimliteError: the file is damaged.
        """
        pq = require("pyarrow.parquet", extra="sweep", purpose="a table of results")
        with report_damage(self._get_results_path()), open_file(self._get_results_path()) as stream:
            return pq.read_table(stream)

    def to_frame(self) -> Any:
        """Return the rows as a pandas DataFrame, indexed by the number of the run.

        Raises:
            OsimliteError: the file is damaged.
            MissingDependency: pandas is not installed.
        """
        require("pandas", extra="frame", purpose="a data frame")
        table = self.to_arrow()
        # The first column is the number of the run.
        return table.to_pandas().set_index(table.column_names[0])

    def to_xarray(self) -> Any:
        """Return the rows as an xarray Dataset over the number of the run.

        Raises:
            OsimliteError: the file is damaged.
            MissingDependency: pandas or xarray is not installed.
        """
        require("xarray", extra="frame", purpose="a data set of xarray")
        return self.to_frame().to_xarray()


@contextmanager
def report_damage(path: str | Path) -> Iterator[None]:
    """Return a context that turns errors of reading Parquet into one that names the file.

    Raises:
        OsimliteError: the code in the context raises an OSError or a ValueError.
    """
    try:
        yield
    except (OSError, ValueError):
        raise OsimliteError(
            "the results are damaged; remove the file, and run the sweep again", file=str(path)
        ) from None


class ColumnRange(NamedTuple):
    """Extremes of a column.

    Attributes:
        least: smallest number.
        run_of_least: number of the run that has it.
        most: largest number.
        run_of_most: number of the run that has it.
        mean: mean of all finite numbers.
    """

    least: float
    run_of_least: int
    most: float
    run_of_most: int
    mean: float


def compute_ranges(path: str | Path, names: Sequence[str]) -> dict[str, ColumnRange]:
    """Compute the extremes and means of columns of results, batch by batch.

    Args:
        path: Parquet file.
        names: names of the columns.

    Returns:
        Range by name; columns without a finite number are left out.
    """
    pq = require("pyarrow.parquet", extra="sweep", purpose="a table of results")
    result: dict[str, ColumnRange] = {}
    counts = dict.fromkeys(names, 0)
    with (
        report_damage(path),
        open_file(path) as stream,
        pq.ParquetFile(stream, page_checksum_verification=True) as file,
    ):
        for batch in file.iter_batches(columns=["run", *names]):
            runs = batch.column("run").to_numpy()
            for name in names:
                column = batch.column(name).to_numpy(zero_copy_only=False)
                is_finite = np.isfinite(column)
                if not is_finite.any():
                    continue
                column, numbers = column[is_finite], runs[is_finite]
                index_of_least, index_of_most = int(column.argmin()), int(column.argmax())
                batch_range = ColumnRange(
                    float(column[index_of_least]),
                    int(numbers[index_of_least]),
                    float(column[index_of_most]),
                    int(numbers[index_of_most]),
                    float(column.mean()),
                )
                earlier_range = result.get(name, batch_range)
                earlier_count = counts[name]
                counts[name] = earlier_count + len(column)
                range_of_least = min(
                    (earlier_range, batch_range), key=lambda column_range: column_range.least
                )
                range_of_most = max(
                    (earlier_range, batch_range), key=lambda column_range: column_range.most
                )
                # Batches have different numbers of finite values, so that means are weighted by
                # them.
                mean = (
                    earlier_range.mean * earlier_count + batch_range.mean * len(column)
                ) / counts[name]
                result[name] = ColumnRange(
                    range_of_least.least,
                    range_of_least.run_of_least,
                    range_of_most.most,
                    range_of_most.run_of_most,
                    mean,
                )
    return result
