"""Check that damaged and endless inputs end soon with one plain error."""

from __future__ import annotations

import contextlib
import json
import os
import sys
import time
import zlib
from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.errors import DocumentError, OsimliteError, SimulationError
from osimlite.io.document.source import Source
from osimlite.io.document.spans import blank_comments
from osimlite.io.meshes.surface import triangulate
from osimlite.io.meshes.vtp import read_vtp
from osimlite.io.tables.storage import StoTable, format_adapter_table, format_sto, write_sto
from osimlite.lint.engine import check_source
from osimlite.studies.reflexes.parameters import read_par
from osimlite.studies.reflexes.settings import read_settings
from tests.cli.command import run

pipes = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pipes among its files")

# ------------------------------------------------------------------------------------------------ scenarios


def write_includes(folder: Path, count: int, times: int) -> Path:
    """Write a chain of files, each including the next one several times; return the first."""
    for number in range(count):
        (folder / f"e{number}.scone").write_text(f"<< e{number + 1}.scone >>\n" * times)
    (folder / f"e{count}.scone").write_text("a = 1\n")
    return folder / "e0.scone"


@pytest.mark.parametrize(
    ("count", "times", "words"),
    [(19, 2, "includes more than"), (30, 1, "endless chain of includes")],
)
def test_includes_have_a_budget(tmp_path: Path, count: int, times: int, words: str) -> None:
    with pytest.raises(DocumentError, match=words):
        read_settings(write_includes(tmp_path, count, times))


def test_an_included_file_may_stand_several_times(tmp_path: Path) -> None:
    assert len(read_settings(write_includes(tmp_path, 3, 3)).parts) == 27


@pytest.mark.parametrize(
    "text",
    [
        "a { " * 5000,
        "a { " * 5000 + "} " * 5000,
        "a: &a\n  b: *a\n",
        "a: " + "[{b: " * 60 + "1" + "}]" * 60,
    ],
)
def test_nesting_has_an_end(tmp_path: Path, text: str) -> None:
    is_yaml = ":" in text
    if is_yaml:
        pytest.importorskip("yaml", reason="needs PyYAML (extra 'yaml')")
    path = tmp_path / ("it.yaml" if is_yaml else "it.scone")
    path.write_text(text)
    if text.startswith("a: ["):
        assert read_settings(path).parts
        return
    with pytest.raises(DocumentError, match=r"levels deep|nested|no end"):
        read_settings(path)


@pytest.mark.parametrize(
    "text", ["include: [a, b]", "include: {a: b}", "? [a, b]\n: 1", "? {a: 1}\n: 2"]
)
def test_includes_of_yaml_are_names(tmp_path: Path, text: str) -> None:
    pytest.importorskip("yaml", reason="needs PyYAML (extra 'yaml')")
    (tmp_path / "it.yaml").write_text(text)
    with pytest.raises(DocumentError, match="must be"):
        read_settings(tmp_path / "it.yaml")


@pytest.mark.parametrize(
    "name", ["secret.txt", "../secret.yaml", ".hidden/a.scone", "/etc/passwd", "link.scone"]
)
def test_includes_show_no_other_files(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "scenario"
    (folder / ".hidden").mkdir(parents=True)
    monkeypatch.setenv("HOME", str(tmp_path))
    for place in (tmp_path / "secret.yaml", folder / "secret.txt", folder / ".hidden" / "a.scone"):
        place.write_text("password hunter2\n")
    if sys.platform != "win32":
        (folder / "link.scone").symlink_to(folder / "secret.txt")
    (folder / "a.scone").write_text(f"<< {name} >>\n")
    with pytest.raises(OsimliteError) as caught:
        read_settings(folder / "a.scone")
    assert "hunter2" not in str(caught.value) and "root:" not in str(caught.value)


@pipes
@pytest.mark.parametrize("name", ["pipe.scone", "/dev/zero", "/dev/null"])
def test_scenarios_are_regular_files(tmp_path: Path, name: str) -> None:
    os.mkfifo(tmp_path / "pipe.scone")
    with pytest.raises(OsimliteError, match="only regular files are read"):
        read_settings(tmp_path / name)
    (tmp_path / "including.scone").write_text(f"<< {name} >>")
    with pytest.raises(OsimliteError):
        read_settings(tmp_path / "including.scone")


@pytest.mark.parametrize(
    "content", [b"a\xff 1 2 3\n", b"a nan 1 2\n", b"a inf 1 2\n", b"a 1 2\n", b"\0\0\0\0"]
)
def test_damaged_parameters(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "it.par").write_bytes(content)
    with pytest.raises(DocumentError):
        read_par(tmp_path / "it.par")


# Invalid settings of an optimizer in a scenario.
SETTINGS = [
    ("lambda", "inf"),
    ("lambda", "nan"),
    ("lambda", "1e99"),
    ("lambda", "1.5"),
    ("max_generations", "inf"),
    ("max_generations", "-1"),
    ("random_seed", "nan"),
    ("random_seed", "-1"),
    ("random_seed", "1e30"),
]


@pytest.mark.parametrize(("key", "value"), SETTINGS)
def test_counts_of_scenarios(tmp_path: Path, key: str, value: str) -> None:
    (tmp_path / "it.scone").write_text(f"CmaOptimizer {{ {key} = {value} }}")
    node = read_settings(tmp_path / "it.scone").parts[0][1]
    with pytest.raises(DocumentError, match=key):
        node.count(key, 1, 0, 10**9)


# ------------------------------------------------------------------------------------------------- c3d, meshes


@pytest.mark.parametrize("damage", range(12))
def test_damaged_c3d_files_end_no_process(tmp_path: Path, fixtures: Path, damage: int) -> None:
    pytest.importorskip("ezc3d", reason="needs ezc3d (extra 'c3d')")
    from osimlite.io.tables.c3d import read_c3d_forces, read_c3d_markers

    data = bytearray((fixtures / "trials" / "force_plate.c3d").read_bytes())
    rng = np.random.default_rng(damage)
    for place in rng.integers(0, 1536, 3):
        data[place] = rng.choice([0, 1, 127, 128, 255])
    (tmp_path / "it.c3d").write_bytes(data)
    for read in (read_c3d_markers, read_c3d_forces):
        with contextlib.suppress(DocumentError):
            read(tmp_path / "it.c3d")


def compressed_mesh(
    kind: str, size: int, blocks: int, promised: int, dtype: str = "Float64", pieces: int = 1
) -> bytes:
    """Return a compressed mesh of zeros for tests of limits.

    Args:
        kind: compressor of VTK, ``ZLib`` or ``LZMA``.
        size: actual size of a block (bytes).
        blocks: number of blocks.
        promised: size of a block (bytes) according to the header.
        dtype: type of the numbers.
        pieces: number of pieces that use the same data.
    """
    import lzma

    compress = zlib.compress if kind == "ZLib" else lzma.compress
    block = compress(bytes(size))
    head = np.array([blocks, promised, 0] + [len(block)] * blocks, "<u8").tobytes()
    start = (
        '<VTKFile type="PolyData" byte_order="LittleEndian" header_type="UInt64" '
        f'compressor="vtk{kind}DataCompressor"><PolyData>'
        + f'<Piece><Points><DataArray type="{dtype}" format="appended" offset="0"/></Points></Piece>'
        * pieces
        + '</PolyData><AppendedData encoding="raw">_'
    )
    return start.encode() + head + block * blocks + b"</AppendedData></VTKFile>"


@pytest.mark.parametrize("kind", ["ZLib", "LZMA"])
@pytest.mark.parametrize(
    ("promised", "words"), [(1_000_000, "more than 400 MB"), (2**62, "more than"), (8, "damaged")]
)
def test_meshes_do_not_grow(kind: str, promised: int, words: str) -> None:
    blocks = 1 if promised == 8 else 500
    with pytest.raises(OsimliteError, match=words):
        read_vtp(compressed_mesh(kind, 1_000_000, blocks, promised), "it.vtp")


@pytest.mark.parametrize("kind", ["ZLib", "LZMA"])
@pytest.mark.parametrize(
    ("blocks", "dtype", "pieces"),
    [(51, "Int8", 1), (51, "UInt8", 1), (101, "Int16", 1), (3, "Int8", 20)],
    ids=["bytes", "bytes without sign", "two bytes", "pieces of one array"],
)
def test_small_numbers_count_as_large_as_they_become(
    kind: str, blocks: int, dtype: str, pieces: int
) -> None:
    with pytest.raises(OsimliteError, match="more than 400 MB"):
        read_vtp(compressed_mesh(kind, 1_000_000, blocks, 1_000_000, dtype, pieces), "it.vtp")


@pytest.mark.parametrize("count", [200, 5000, 100_000])
def test_polygons_of_many_corners(count: int) -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    radii = 1.0 + np.random.default_rng(1).random(count)
    points = np.stack([radii * np.cos(angles), radii * np.sin(angles), 0.0 * angles], axis=1)
    begin = time.process_time()
    assert len(triangulate(points, np.arange(count), np.array([count]))) == count - 2
    assert time.process_time() - begin < 10.0


# --------------------------------------------------------------------------------------------------- texts

# Beginnings of constructs that a text never closes.
OPEN = [
    "<!--",
    "<a ",
    "<",
    "<?x ",
    "<![CDATA[",
    '<x a="<" ',
    "<\n",
    "<<<<<<<\n",
    "<?",
    "</a",
    "<!-- osimlite: ignore ",
]


@pytest.mark.parametrize("word", OPEN)
def test_the_time_of_a_text_is_that_of_its_length(word: str, fixtures: Path) -> None:
    text = (fixtures / "pipelines" / "pendulum" / "model.osim").read_text()
    place = text.index("<JointSet")

    def check(count: int) -> float:
        source = Source((text[:place] + word * count + text[place:]).encode(), "it.osim")
        begin = time.process_time()
        check_source(source)
        return time.process_time() - begin

    check(1)
    short, long = check(4000), check(16000)
    # The time must grow linearly: four times the text took sixteen times as long before.
    assert long < 10.0 * short + 1.0


def test_the_time_of_many_attributes_is_that_of_their_number(fixtures: Path) -> None:
    text = (fixtures / "pipelines" / "pendulum" / "model.osim").read_text()
    place = text.index("<JointSet")

    def check(count: int) -> float:
        element = "<note " + " ".join(f'a{k}="{k}"' for k in range(count)) + "/>"
        source = Source((text[:place] + element + text[place:]).encode(), "it.osim")
        begin = time.process_time()
        check_source(source)
        return time.process_time() - begin

    check(1)
    assert check(20000) < 10.0 * check(5000) + 0.3


@pytest.mark.parametrize(
    ("text", "blank"),
    [
        ("a<!-- <b> -->c", "a" + " " * 12 + "c"),
        ("<![CDATA[<x>]]>y", " " * 15 + "y"),
        ("<?x?><!DOCTYPE a>z", " " * 17 + "z"),
        ("<!-- <!-- open", "<!-- <!-- open"),
        ("<!-- <?x y?> z", "<!-- " + " " * 7 + " z"),
    ],
)
def test_remarks_are_blanked(text: str, blank: str) -> None:
    assert blank_comments(text) == blank


# ------------------------------------------------------------------------------------- data, settings, classes


@pytest.mark.parametrize("number", ["9" * 400, "-" + "9" * 400, "9" * 5000])
def test_whole_numbers_of_any_length(tmp_path: Path, number: str) -> None:
    pytest.importorskip("yaml", reason="needs PyYAML (extra 'yaml')")
    for name, text in (
        ("m.yaml", f"gravity: [0, {number}, 0]\n"),
        ("m.json", f'{{"gravity": [0, {number}, 0]}}'),
    ):
        (tmp_path / name).write_text(text)
        with pytest.raises(OsimliteError):
            osimlite.io.document.data.read_data(tmp_path / name)


# Invalid settings files: name, content, and whether the file is ignored instead of rejected.
BROKEN_SETTINGS = [
    ("pyproject.toml", "tool = 5", True),
    ("pyproject.toml", "[[tool]]\nx = 1", True),
    ("pyproject.toml", "[tool]\nosimlite = 5", True),
    ("osimlite.toml", "a = " + "[" * 50_000, False),
    ("osimlite.toml", "a = " + "{a=" * 5000, False),
    ("osimlite.toml", "largest-file = " + "9" * 400, False),
    ("osimlite.toml", "largest-file = nan", False),
    ("osimlite.toml", "select = [1]", False),
    ("osimlite.toml", "severity = {OSIM101 = []}", False),
    ("osimlite.toml", "per-file-ignores = {a = 5}", False),
    ("osimlite.toml", "per-file-ignores = {a = [[1]]}", False),
]


@pytest.mark.parametrize(
    ("name", "text", "is_ignored"), BROKEN_SETTINGS, ids=range(len(BROKEN_SETTINGS))
)
def test_settings_that_make_no_sense(
    tmp_path: Path, fixtures: Path, name: str, text: str, is_ignored: bool
) -> None:
    (tmp_path / "m.osim").write_text(
        '<OpenSimDocument Version="40600"><Model name="m"/></OpenSimDocument>'
    )
    (tmp_path / name).write_text(text)
    done = run("validate", "m.osim", "--no-cache", folder=tmp_path)
    assert (done.code == 2) == (not is_ignored)


CLASS = '{"classes":{"My":{"bases":["Force"],"properties":[{"name":"x","type":"double",%s}]}}}'
# Invalid declarations of plug-in classes.
CLASSES = [
    CLASS % '"min":"abc"',
    CLASS % '"min":[1]',
    CLASS % '"max":1e400',
    CLASS % '"kind":"list","min":-1',
    CLASS % '"unit":{"a":1}',
    CLASS % '"kind":{}',
    CLASS % '"default":{"a":[]}',
    '{"classes":{},"references":[{"cls":"A","property":"a","resolution":["body-name"]}]}',
    '{"classes":{"My":{"bases":["Force"],"outputs":[5]}}}',
    json.dumps(
        {
            "classes": {
                f"C{i}": {"bases": [f"C{i + 1}" if i < 1500 else "Force"]} for i in range(1501)
            }
        }
    ),
]


@pytest.mark.parametrize("text", CLASSES, ids=range(len(CLASSES)))
def test_classes_that_make_no_sense(tmp_path: Path, text: str) -> None:
    from osimlite.io.document.plugins import classes_in

    (tmp_path / "c.json").write_text(text)
    with pytest.raises(OsimliteError):
        classes_in(tmp_path / "c.json")


# ------------------------------------------------------------------------------------------- what is written


@pytest.mark.parametrize("name", ["a\tb", "a\nb", "a\nendheader\nb", "a\r", "a\u2028b", "a\x0b"])
def test_names_do_not_break_tables(tmp_path: Path, name: str) -> None:
    from osimlite.io.tables.old_storage import format_old_table

    times, rows = np.zeros(1), np.zeros((1, 1))
    for make in (
        lambda: format_sto("t", [0.0], [name], [[0.0]]),
        lambda: write_sto(tmp_path / "t.sto", name, [0.0], ["c"], [[0.0]]),
        lambda: [*format_old_table(StoTable("t", times, (name,), rows))],
        lambda: [*format_adapter_table(StoTable("", times, (name,), rows))],
        lambda: [*format_adapter_table(StoTable("", times, ("c",), rows, header={"k": name}))],
    ):
        with pytest.raises(OsimliteError, match="a tab or a line end"):
            make()


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_no_table_has_nan_as_a_result(tmp_path: Path, value: float) -> None:
    rows = [[0.0, 1.0], [value, 1.0]]
    with pytest.raises(SimulationError, match=r"'a' of the results is -?(nan|inf) at 0\.5 s"):
        write_sto(tmp_path / "t.sto", "t", [0.0, 0.5], ["a", "b"], rows)
    assert not list(tmp_path.iterdir())
    write_sto(tmp_path / "t.sto", "t", [0.0, 0.5], ["a", "b"], rows, has_missing=True)


def test_tables_of_tools_say_where_they_have_nan(tmp_path: Path) -> None:
    from osimlite.base.result_writing import ResultWriter
    from osimlite.tools.outcome import Outcome

    outcome = Outcome()
    table = StoTable("Forces", np.zeros(1), ("a", "b"), np.array([[np.nan, 1.0]]))
    outcome.add_table(tmp_path / "old.sto", table, "about it\n")
    outcome.add_typed_table(tmp_path / "new.sto", table)
    setup = tmp_path / "setup.xml"
    setup.write_text(
        '<OpenSimDocument Version="40600"><InverseDynamicsTool name="a"/></OpenSimDocument>'
    )
    outcome.write(setup, ResultWriter.for_document(setup))
    assert outcome.messages == [
        ("missing values", "old.sto has NaN where a value is missing, in 'a'")
    ]
    for name in ("old.sto", "new.sto"):
        head, _, _ = (tmp_path / name).read_text().partition("endheader")
        assert "NaN stands for missing values, in 'a'" in head


def test_linearize_gives_no_nan(fixtures: Path) -> None:
    model = osimlite.read(fixtures / "pipelines" / "pendulum" / "model.osim")
    osimlite.linearize(model)
    for part in model.walk():
        if isinstance(part, osimlite.Body):
            part.mass = 1e308
            part.mass_center = (1e308, 1e308, 0.0)
    with np.errstate(all="ignore"), pytest.raises(OsimliteError):
        osimlite.linearize(model)


@pytest.mark.parametrize(
    "name", ["@DATA@", "@SCRIPT@", "@LIBRARY@", "@TITLE@ @STYLE@", "\\1 \\g<0>"]
)
def test_names_are_no_placeholders_of_the_page(fixtures: Path, tmp_path: Path, name: str) -> None:
    import html

    model = osimlite.read(fixtures / "pipelines" / "pendulum" / "model.osim")
    model.name = name
    osimlite.write(model, tmp_path / "m.osim")
    assert run("view", "m.osim", "--html", "page.html", folder=tmp_path).code == 0
    text = (tmp_path / "page.html").read_text()
    assert f"<title>{html.escape(name)}</title>" in text
    data = text.partition('id="data">')[2].partition("</script>")[0]
    assert json.loads(data)["name"] == name
