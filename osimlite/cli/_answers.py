"""Answers that take long to find and follow from a text alone: kept where the linter keeps its findings."""

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


def answer_from_cache(
    question: str, file: str, data: bytes, find: Callable[[], tuple[str, bool]]
) -> str:
    """What was found for a text before, by this very osimlite, or what is found now.

    Args:
        question: what is asked.
        file: where the text stands.
        data: the text.
        find: finds the answer, and whether it follows from the text alone.
    """
    key = [question, make_key(file, Config()), blake2b(data).hexdigest()]
    place = crc32(f"{question} {os.path.abspath(file)}".encode(errors="surrogateescape"))
    folder = user_cache_folder()
    if folder is None:
        return find()[0]
    kept = folder / __version__ / "answers" / f"{place:08x}.json"
    with suppress(OsimliteError, ValueError, RecursionError):
        match json.loads(read_file(kept)):
            case [known, str(answer)] if known == key:
                mark_used(kept)
                return answer
    answer, lasts = find()
    if lasts:
        write_cached(kept, json.dumps([key, answer]))
    return answer
