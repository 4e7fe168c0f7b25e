"""Tests of the gallery: every part has a small picture and a recipe in the repository; one picture is made here."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

pytest.importorskip("mkdocs", reason="needs mkdocs (extra 'dev')")
from docs import _gallery as gallery

PNG = b"\x89PNG\r\n"


def test_every_part_has_a_picture_what_makes_it_and_a_page() -> None:
    parts = gallery.find_sections(gallery.PAGE.read_text(encoding="utf-8"))
    assert len(parts) > 5
    for part in parts:
        (name,) = re.findall(r"^!\[[^]]+\]\(gallery/(.+\.png)\)$", part, re.M)
        assert name.split("/")[0].split(".")[0] in part.split("```")[1]
        assert re.search(r"\]\(\w[\w-]*\.md(#[\w-]+)?\)", part), part


def test_a_part_makes_its_picture() -> None:
    pytest.importorskip("PIL", reason="needs pillow (extra 'view')")
    (elbow,) = (
        part
        for part in gallery.find_sections(gallery.PAGE.read_text(encoding="utf-8"))
        if "elbow.png" in part
    )
    name, picture = gallery.make_picture(elbow)
    assert name == "elbow.png" and picture.startswith(PNG)


def test_every_picture_is_in_the_repository_and_small() -> None:
    names = [
        gallery.find_picture_name(part)
        for part in gallery.find_sections(gallery.PAGE.read_text(encoding="utf-8"))
    ]
    files = {path.relative_to(gallery.FOLDER).as_posix() for path in gallery.FOLDER.rglob("*.png")}
    assert files == {*names}
    for name in names:
        picture = (gallery.FOLDER / name).read_bytes()
        assert picture.startswith(PNG) and len(picture) < 150_000


def test_every_comparison_has_a_picture_of_before_and_one_of_after() -> None:
    compare = pytest.importorskip("docs._compare", reason="needs pyte (extra 'dev')")
    shown = re.findall(
        r"\]\(gallery/(before|after)/([\w-]+)\.webp\)", gallery.PAGE.read_text("utf-8")
    )
    # On the page, each picture of `before` stands above that of `after`.
    assert shown == [(when, name) for name in compare.DRAW for when in ("before", "after")]
    files = {path.relative_to(gallery.FOLDER) for path in gallery.FOLDER.rglob("*.webp")}
    assert files == {Path(when, f"{name}.webp") for when, name in shown}
    sizes = [(gallery.FOLDER / file).stat().st_size for file in files]
    assert max(sizes) < 150_000 and sum(sizes) < 1_500_000


def test_a_comparison_runs_the_editor_and_a_terminal(tmp_path: Path) -> None:
    compare = pytest.importorskip("docs._compare", reason="needs pyte (extra 'dev')")
    pytest.importorskip("pygls", reason="needs pygls (extra 'lsp')")
    lines = [*compare.talk_to_server(compare.ROOT, tmp_path)]
    start = lines.index("$ quick fixes with the cursor at the start")
    assert lines[start + 1] == "  Change to '/bodyset/rod' (look at the result)"
    assert any(line.startswith("  exit code 130") for line in lines)
    screen = compare.read_screen(compare.ROOT, tmp_path, ["rule", "OSIM301"])
    assert "OSIM301" in screen[0] and max(map(len, screen)) <= 80


def test_pictures_are_shrunk() -> None:
    image = pytest.importorskip("PIL.Image", reason="needs pillow (extra 'view')")
    import io

    out = io.BytesIO()
    image.new("RGB", (1800, 90), "white").save(out, format="png")
    assert image.open(io.BytesIO(gallery.shrink_picture(out.getvalue()))).size == (900, 45)
