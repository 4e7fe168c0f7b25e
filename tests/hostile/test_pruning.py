"""Check that pruning the user's cache removes unused entries and nothing else."""

from __future__ import annotations

import os
import sys
import threading
import time
from pathlib import Path

import pytest

from osimlite.base.pruning import DAY_S, MARKER, UNUSED_DAYS, is_due, mark_used, prune_cache
from osimlite.base.writing import write_cached

OLD_S = (UNUSED_DAYS + 1.0) * DAY_S
needs_links = pytest.mark.skipif(sys.platform == "win32", reason="Windows users may make no links")


def make_entry(folder: Path, name: str, age_s: float, size: int = 10) -> Path:
    """Make a cache entry that was last used `age_s` seconds ago."""
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"x" * size)
    moment = time.time() - age_s
    os.utime(path, (moment, moment))
    return path


def test_old_entries_go_and_others_stay(tmp_path: Path):
    old = make_entry(tmp_path, "0.1.0/09/a.json", OLD_S)
    new = make_entry(tmp_path, "0.1.0/09/b.json", OLD_S - 2.0 * DAY_S)
    code = make_entry(tmp_path, "kernel.so", OLD_S)
    assert prune_cache(tmp_path, time.time()) == 1
    assert not old.exists() and new.exists() and code.exists()


def test_the_entries_used_longest_ago_go_when_there_are_too_many(tmp_path: Path):
    entries = [make_entry(tmp_path, f"0.1.0/{age}.json", age * DAY_S, 100) for age in range(10)]
    assert prune_cache(tmp_path, time.time(), max_bytes=1000) == 0
    assert prune_cache(tmp_path, time.time(), max_bytes=500) == 6
    assert [entry.exists() for entry in entries] == [True] * 4 + [False] * 6


def test_an_entry_that_is_used_stays(tmp_path: Path):
    entry = make_entry(tmp_path, "a.json", OLD_S)
    mark_used(entry)
    assert prune_cache(tmp_path, time.time()) == 0
    mark_used(tmp_path / "missing.json")


@needs_links
def test_links_are_neither_followed_nor_removed(tmp_path: Path):
    cache, home = tmp_path / "cache", tmp_path / "home"
    precious = make_entry(home, "precious.json", OLD_S)
    cache.mkdir()
    (cache / "folder").symlink_to(home)
    (cache / "file.json").symlink_to(precious)
    mark_used(cache / "file.json")
    assert prune_cache(cache, time.time()) == 0
    assert precious.exists() and (cache / "file.json").is_symlink()
    assert time.time() - precious.stat().st_mtime > OLD_S - DAY_S


@needs_links
def test_a_folder_that_becomes_a_link_meanwhile_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    from osimlite.base import pruning

    cache, home = tmp_path / "cache", tmp_path / "home"
    make_entry(cache, "09/a.json", OLD_S)
    precious = make_entry(home, "a.json", OLD_S)
    find = pruning.find_entries

    def find_and_swap(folder: str):
        entries = [*find(folder)]
        (cache / "09").rename(tmp_path / "moved")
        (cache / "09").symlink_to(home)
        return iter(entries)

    monkeypatch.setattr(pruning, "find_entries", find_and_swap)
    assert prune_cache(cache, time.time()) == 0
    assert precious.exists()


def test_several_may_prune_at_once(tmp_path: Path):
    for number in range(200):
        make_entry(tmp_path, f"{number % 7}/{number}.json", OLD_S)
    removed: list[int] = []
    threads = [
        threading.Thread(target=lambda: removed.append(prune_cache(tmp_path, time.time())))
        for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sum(removed) == 200
    assert not [*tmp_path.rglob("*.json")]


@pytest.mark.skipif(
    sys.platform != "linux", reason="the variable of the cache folder is that of Linux"
)
def test_writing_prunes_once_a_day(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    folder = tmp_path / "osimlite"
    old = make_entry(folder, "0.1.0/a.json", OLD_S)
    write_cached(folder / "0.1.0" / "b.json", "{}")
    assert not old.exists() and (folder / "0.1.0" / "b.json").exists()
    assert not is_due(folder, time.time())
    again = make_entry(folder, "0.1.0/a.json", OLD_S)
    write_cached(folder / "0.1.0" / "b.json", "{}")
    assert again.exists()
    yesterday = time.time() - 1.1 * DAY_S
    os.utime(folder / MARKER, (yesterday, yesterday))
    write_cached(folder / "0.1.0" / "c.json", "{}")
    assert not again.exists()
