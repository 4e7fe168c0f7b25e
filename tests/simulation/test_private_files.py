"""Tests of the check that no other user can write a file whose content is executed, or its folders."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from osimlite.errors import OsimliteError
from osimlite.simulation.engines.private_files import (
    find_other_writers,
    read_private,
    write_private,
)

pytestmark = pytest.mark.skipif(
    sys.platform == "win32", reason="who may write is not told by bits there"
)


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    """Write a file in two new folders, and return its path."""
    write_private(tmp_path / "outer" / "inner" / "kept", b"code")
    return tmp_path / "outer" / "inner" / "kept"


def test_only_the_user_can_touch_what_is_written(kept):
    assert read_private(kept) == b"code"
    for place in (kept, kept.parent, kept.parent.parent):
        assert place.stat().st_mode & 0o077 == 0
    write_private(kept, b"new code")
    assert read_private(kept) == b"new code" and list(kept.parent.iterdir()) == [kept]


@pytest.mark.parametrize("mode", [0o620, 0o602, 0o666, 0o660])
def test_a_file_that_others_can_write_is_not_read(kept, mode):
    kept.chmod(mode)
    assert read_private(kept) is None
    write_private(kept, b"new code")
    assert read_private(kept) == b"new code"


@pytest.mark.parametrize("mode", [0o720, 0o702, 0o777, 0o1777])
@pytest.mark.parametrize("up", [0, 1])
def test_a_folder_that_others_can_write_is_not_used(kept, mode, up):
    place = kept.parents[up]
    place.chmod(mode)
    if up and mode & 0o1000:
        # With the sticky bit, others cannot replace our folder.
        assert read_private(kept) == b"code"
        return
    assert read_private(kept) is None
    with pytest.raises(OsimliteError, match=f"'{place}' can be written by others"):
        write_private(kept, b"new code")
    assert kept.read_bytes() == b"code" and [*kept.parent.iterdir()] == [kept]


@pytest.mark.parametrize("up", [-1, 0, 1])
def test_what_belongs_to_another_is_not_used(kept, up):
    if os.geteuid() != 0:
        pytest.skip("only root can give files away")
    place = kept if up < 0 else kept.parents[up]
    os.chown(place, 12345, -1)
    assert read_private(kept) is None
    if up >= 0:
        with pytest.raises(OsimliteError, match=f"'{place}' belongs to another user"):
            write_private(kept, b"new code")


def test_what_belongs_to_root_is_used_and_what_to_neither_is_not(kept, monkeypatch):
    owner = os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: 54321)
    assert (read_private(kept) is None) == (owner != 0)


def test_links_are_followed_to_where_they_lead(kept, tmp_path):
    (tmp_path / "way").symlink_to(kept.parent)
    assert read_private(tmp_path / "way" / "kept") == b"code"
    kept.parent.chmod(0o777)
    assert read_private(tmp_path / "way" / "kept") is None
    kept.parent.chmod(0o700)
    # A link to a file is not accepted.
    (kept.parent / "alias").symlink_to(kept)
    assert read_private(kept.parent / "alias") is None


def test_special_files_and_nothing(kept, tmp_path):
    os.mkfifo(kept.parent / "pipe")
    assert read_private(kept.parent / "pipe") is None
    for nothing in (kept.parent / "none", tmp_path / "none" / "none", kept / "inside", kept.parent):
        assert read_private(nothing) is None


def test_a_folder_in_tmp_is_as_safe_as_any(tmp_path):
    assert find_other_writers(Path(os.path.realpath(tmp_path))) is None
