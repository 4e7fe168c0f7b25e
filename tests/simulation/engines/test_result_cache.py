"""Tests of results that processes cache for later processes."""

from __future__ import annotations

import pytest

from osimlite.simulation.engines.result_cache import CACHE_VARIABLE, ResultCache


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "kept"))
    return tmp_path / "kept"


def test_results_are_read_again():
    results = ResultCache("a", "key")
    assert results.get("one") is None
    results.keep("one", ["x", 1])
    assert results.get("one") == ["x", 1] and ResultCache("a", "key").get("one") is None
    results.save()
    assert ResultCache("a", "key").get("one") == ["x", 1]
    assert ResultCache("b", "key").get("one") is None


def test_another_key_forgets_them():
    results = ResultCache("a", "key")
    results.keep("one", 1)
    results.save()
    assert ResultCache("a", "other").get("one") is None


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b'{"key": 1}', b"\xff"])
def test_a_damaged_file_is_forgotten(folder, content):
    results = ResultCache("a", "key")
    results.keep("one", 1)
    results.save()
    (file,) = folder.iterdir()
    file.write_bytes(content)
    assert ResultCache("a", "key").get("one") is None


def test_a_file_that_others_can_write_is_not_read(folder):
    results = ResultCache("a", "key")
    results.keep("one", 1)
    results.save()
    folder.chmod(0o777)
    try:
        assert ResultCache("a", "key").get("one") is None
    finally:
        folder.chmod(0o700)


def test_without_a_folder_nothing_is_kept(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "file" / "inside"))
    results = ResultCache("a", "key")
    results.keep("one", 1)
    results.save()
    assert ResultCache("a", "key").get("one") is None
