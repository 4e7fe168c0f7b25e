"""Cache of slow results that depend on the content of one file, in the linter's cache folder."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from contextlib import suppress
from hashlib import blake2b
from zlib import crc32

from osimlite import __version__
from osimlite.base.files import read_file
from osimlite.base.pruning import mark_used
from osimlite.base.writing import user_cache_folder, write_cached
from osimlite.errors import OsimliteError
from osimlite.lint.cache import make_key
from osimlite.lint.config import Config


def compute_or_load(
    question: str, file: str, data: bytes, compute: Callable[[], tuple[str, bool]]
) -> str:
    """Return a cached result for a file, or compute and cache it.

    Args:
        question: name of the result.
        file: path of the file.
        data: content of the file.
        compute: function that returns the result, and whether it depends on the content alone.
            Only such results are cached.
    """
    key = [question, make_key(file, Config()), blake2b(data).hexdigest()]
    checksum = crc32(f"{question} {os.path.abspath(file)}".encode(errors="surrogateescape"))
    folder = user_cache_folder()
    if folder is None:
        return compute()[0]
    path = folder / __version__ / "answers" / f"{checksum:08x}.json"
    with suppress(OsimliteError, ValueError, RecursionError):
        match json.loads(read_file(path)):
            case [cached_key, str(cached_result)] if cached_key == key:
                mark_used(path)
                return cached_result
    result, is_cacheable = compute()
    if is_cacheable:
        write_cached(path, json.dumps([key, result]))
    return result
