"""Tests of reading and replacing files: only regular files up to the size limit are read."""

from __future__ import annotations

import os
import socket
import sys
from collections.abc import Callable, Iterator
from contextlib import chdir, closing
from pathlib import Path

import pytest

from osimlite.base import files
from osimlite.base.files import read_file
from osimlite.errors import MissingFileError, OsimliteError, SpecialFileError
from osimlite.io.document.source import Source
from osimlite.lint.engine import check_source
from tests.cli.command import Done, run

pytestmark = pytest.mark.skipif(
    sys.platform == "win32", reason="Windows has no pipes and devices among its files"
)

BODIES = """<OpenSimDocument Version="40600"><BodySet name="bodyset"><objects><Body name="b">
<mass>1</mass><inertia>1 1 1 0 0 0</inertia></Body></objects></BodySet></OpenSimDocument>"""
INCLUDING = '<OpenSimDocument Version="40600"><Model name="m"><BodySet file="{}" /></Model></OpenSimDocument>'
KINDS = (
    "pipe",
    "socket",
    "device",
    "link to a device",
    "link to a pipe",
    "endless device",
    "block device",
)


@pytest.fixture(params=KINDS)
def special(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Path]:
    """Return a path with the name of a model that is not a regular file, one for each of KINDS."""
    place = tmp_path / "special.osim"
    match request.param:
        case "pipe":
            os.mkfifo(place)
        case "device":
            place = Path("/dev/null")
        case "endless device":
            place = Path("/dev/zero")
        case "block device":
            place = next((path for path in Path("/dev").iterdir() if path.is_block_device()), place)
            if place.name == "special.osim":
                pytest.skip("this machine shows no block device")
        case "link to a device":
            place.symlink_to("/dev/zero")
        case "link to a pipe":
            os.mkfifo(tmp_path / "pipe")
            place.symlink_to("pipe")
        case "socket":
            with closing(socket.socket(socket.AF_UNIX)) as made:
                # The path of a socket has at most about 100 bytes, and that of the folder may be longer.
                with chdir(tmp_path):
                    made.bind(place.name)
                yield place
                return
    yield place


def test_what_is_no_file_is_not_read(special: Path) -> None:
    with pytest.raises(
        SpecialFileError, match=r"this is a (pipe|socket|device); only regular files are read"
    ):
        read_file(special)


def test_what_is_no_file_is_one_finding(special: Path, tmp_path: Path) -> None:
    done = run("validate", special, "--format", "concise", "--no-cache", folder=tmp_path)
    assert (done.code, done.err) == (1, "")
    assert done.out.startswith(f"{special}:1:1: error OSIM003 cannot read the file: this is a ")
    assert done.out.endswith("Found 1 error in 1 file.\n")


def test_what_is_no_file_is_not_included(special: Path, tmp_path: Path) -> None:
    (tmp_path / "m.osim").write_text(INCLUDING.format(special))
    done = run("validate", "m.osim", "--format", "concise", "--no-cache", folder=tmp_path)
    assert done.code == 0
    assert (
        f"warning OSIM702 BodySet should be read from '{special}', which is not read: this is a "
        in done.out
    )


def test_what_is_no_file_is_not_included_in_an_editor(special: Path, tmp_path: Path) -> None:
    """The text in an editor may belong to a file that does not exist yet."""
    source = Source.from_text(INCLUDING.format(special), str(tmp_path / "new.osim"))
    (result,) = (finding for finding in check_source(source) if finding.code == "OSIM702")
    assert "which is not read: this is a " in result.message and result.message.endswith(
        ": the object stays empty"
    )


@pytest.mark.parametrize("command", ["info", "format", "upgrade", "translate", "simulate"])
def test_every_command_says_so(tmp_path: Path, command: str) -> None:
    os.mkfifo(tmp_path / "special.osim")
    done = run(command, "special.osim", folder=tmp_path)
    assert done.code == 2
    assert (
        "special.osim: cannot read the file: this is a pipe; only regular files are read"
        in done.err
    )


def test_the_rest_of_a_folder_is_checked(tmp_path: Path) -> None:
    (tmp_path / "folder.osim").mkdir()
    os.mkfifo(tmp_path / "folder.osim" / "a.osim")
    (tmp_path / "b.osim").write_text(
        '<OpenSimDocument Version="40600"><Model><gravty/></Model></OpenSimDocument>'
    )
    done = run("validate", ".", "--format", "concise", "--no-cache", folder=tmp_path)
    assert done.code == 1 and "OSIM101" in done.out and "OSIM003" in done.out
    assert done.out.endswith("Found 2 errors in 2 files.\n")


def test_tables_and_data_come_from_files(tmp_path: Path) -> None:
    from osimlite.io.document.data import read_data
    from osimlite.io.tables.table_stream import TableStream

    for name in ("model.json", "model.yaml", "motion.sto"):
        os.mkfifo(tmp_path / name)
        with pytest.raises(SpecialFileError, match="this is a pipe"):
            (TableStream if name == "motion.sto" else read_data)(tmp_path / name)


def test_a_pipe_that_takes_the_place_of_a_file_is_not_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    os.mkfifo(tmp_path / "pipe")
    ordinary, real = os.stat(tmp_path / "file"), os.stat
    monkeypatch.setattr(
        os, "stat", lambda path, **words: ordinary if "pipe" in str(path) else real(path, **words)
    )
    with pytest.raises(SpecialFileError, match="this is a pipe"):
        read_file(tmp_path / "pipe")


@pytest.mark.parametrize("name", ["x" * 5000, "a\0b", "\ud800", "gone.osim"])
def test_names_that_no_file_has(name: str, tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match="cannot read the file: "):
        read_file(tmp_path / name)


def test_a_file_whose_system_does_not_know_its_size(tmp_path: Path) -> None:
    if not Path("/proc/self/status").exists():
        pytest.skip("this system has no /proc")
    assert os.stat("/proc/self/status").st_size == 0
    assert read_file("/proc/self/status").startswith(b"Name:")


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("osimlite.base.files", "osimlite.base.project"):
        monkeypatch.setattr(f"{module}.DEFAULT_MAX_FILE_BYTES", 1_000_000)


def test_a_large_file_is_not_read(
    tmp_path: Path, small: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = tmp_path / "m.osim"
    with place.open("wb") as stream:
        stream.truncate(2_000_000)
    with pytest.raises(
        SpecialFileError,
        match=r"larger than 1 MB; allow it by 'largest-file' in osimlite.toml",
    ):
        read_file(place)
    (tmp_path / "osimlite.toml").write_text("largest-file = 1.5\n")
    with pytest.raises(SpecialFileError, match=r"larger than 1.5 MB"):
        read_file(place)
    (tmp_path / "osimlite.toml").write_text("largest-file = 2\n")
    assert len(read_file(place)) == 2_000_000
    # A file that grows while it is read, or whose size is unknown, has the same limit.
    unknown = os.stat_result((0o100644, 0, 0, 1, 0, 0, 0, 0, 0, 0))
    monkeypatch.setattr("osimlite.base.files.os.fstat", lambda handle: unknown)
    assert len(read_file(place)) == 2_000_000
    with place.open("ab") as stream:
        stream.write(b"x")
    with pytest.raises(SpecialFileError, match="larger than 2 MB"):
        read_file(place)


@pytest.mark.parametrize("given", ["0", "-1", "99", "inf", "nan", "true", '"1 GB"', "[]"])
def test_a_size_that_makes_no_sense(tmp_path: Path, given: str) -> None:
    from osimlite.lint.settings import load_settings

    (tmp_path / "osimlite.toml").write_text(f"largest-file = {given}\n")
    with pytest.raises(
        OsimliteError, match="'largest-file' must be a number of MB, 100 or more, not"
    ):
        load_settings(tmp_path)


def test_an_endless_standard_input_is_not_read_to_the_end(
    monkeypatch: pytest.MonkeyPatch, small: None
) -> None:
    with open("/dev/zero", encoding="latin-1") as endless:
        monkeypatch.setattr(sys, "stdin", endless)
        with pytest.raises(
            SpecialFileError, match="<stdin>: cannot read the file: it is larger than 1 MB"
        ):
            files.read_standard_input()


def test_a_few_files_that_name_each_other_are_not_read_without_end(
    tmp_path: Path, small: None
) -> None:
    """Each file names the next one twice: without a limit the last of 30 files would be read 2**29 times."""
    import osimlite

    body = '<Body name="{}" file="{}.xml" />'
    for number in range(30):
        inner = body.format("l", number + 1) + body.format("r", number + 1)
        (tmp_path / f"{number}.xml").write_text(
            f'<OpenSimDocument Version="40600"><Body name="b"><components>{inner}</components></Body></OpenSimDocument>'
        )
    (tmp_path / "m.osim").write_text(
        '<OpenSimDocument Version="40600"><Model name="m"><components><Body file="0.xml" /></components></Model>'
        "</OpenSimDocument>"
    )
    model = osimlite.read(tmp_path / "m.osim")
    assert 1 < sum(1 for _ in model.components()) < 200


def test_files_that_name_each_other_deeply(tmp_path: Path) -> None:
    for number in range(400):
        (tmp_path / f"{number}.xml").write_text(
            '<OpenSimDocument Version="40600"><Body name="b"><components>'
            f'<Body file="{number + 1}.xml" /></components></Body></OpenSimDocument>'
        )
    (tmp_path / "m.osim").write_text(
        '<OpenSimDocument Version="40600"><Model name="m"><components><Body file="0.xml" /></components></Model>'
        "</OpenSimDocument>"
    )
    done = run("validate", "m.osim", "--format", "concise", "--no-cache", folder=tmp_path)
    assert "too many levels of files that refer to each other" in done.out


MESSY = '<OpenSimDocument Version="40600"><Model name="m"><gravity>0  -5 0</gravity ></Model></OpenSimDocument>'
WRITING = (["format"], ["validate", "--fix", "--no-cache"])


@pytest.fixture(params=WRITING, ids=["format", "fix"])
def rewrite(request: pytest.FixtureRequest) -> Callable[..., Done]:
    """Return a function that runs the command on files; the command rewrites files whose text it changes."""
    return lambda *paths: run(*request.param, *paths)


def test_a_read_only_file_is_not_replaced(tmp_path: Path, rewrite: Callable[..., Done]) -> None:
    """Permissions do not stop the superuser, so osimlite checks them itself; other files are written all the same."""
    fixed, other = tmp_path / "a.osim", tmp_path / "b.osim"
    for place in (fixed, other):
        place.write_text(MESSY)
    fixed.chmod(0o444)
    done = rewrite(fixed, other)
    assert done.code == 2
    assert f"{fixed}: cannot write the file: it is read-only; make it writable first" in done.err
    assert fixed.read_text() == MESSY and fixed.stat().st_mode & 0o777 == 0o444
    assert other.read_text() != MESSY
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.osim", "b.osim"]


def test_every_name_of_a_file_stays_one_of_it(tmp_path: Path, rewrite: Callable[..., Done]) -> None:
    place, other, link = tmp_path / "a.osim", tmp_path / "b.txt", tmp_path / "c.osim"
    place.write_text(MESSY + " " * 10_000)
    place.chmod(0o640)
    other.hardlink_to(place)
    link.symlink_to(place)
    assert rewrite(link).code == 0
    assert other.samefile(place) and link.is_symlink()
    assert other.read_text() == place.read_text() != MESSY
    assert place.stat().st_mode & 0o777 == 0o640
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.osim", "b.txt", "c.osim"]


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only the superuser gives files away"
)
def test_a_file_keeps_its_owner_and_mode(tmp_path: Path, rewrite: Callable[..., Done]) -> None:
    place = tmp_path / "a.osim"
    place.write_text(MESSY)
    os.chown(place, 1234, 4321)
    place.chmod(0o600)
    assert rewrite(place).code == 0
    result = place.stat()
    assert (result.st_uid, result.st_gid, result.st_mode & 0o777) == (1234, 4321, 0o600)
    assert place.read_text() != MESSY


def test_what_cannot_be_given_to_a_new_file_stays_on_the_old(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = tmp_path / "a.osim"
    place.write_text("before " * 100)
    number = place.stat().st_ino

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "chmod", refuse)
    files.write_atomically(place, "after")
    assert place.read_text() == "after" and place.stat().st_ino == number
    monkeypatch.setattr("shutil.copyfileobj", refuse)
    with pytest.raises(OsimliteError, match=r"not permitted; the new content is in (.*)") as caught:
        files.write_atomically(place, "later")
    assert Path(str(caught.value).rpartition(" ")[2]).read_text() == "later"


@pytest.mark.parametrize("name", ["x" * 250 + ".osim", "ä" * 125 + ".osim"])
def test_a_name_as_long_as_may_be(tmp_path: Path, rewrite: Callable[..., Done], name: str) -> None:
    place = tmp_path / name
    place.write_text(MESSY)
    assert rewrite(place).code == 0
    assert place.read_text() != MESSY
