"""Every part of the gallery has a small picture in the repository and what makes it; this makes one."""

from __future__ import annotations

import re

import pytest

pytest.importorskip("mkdocs", reason="needs mkdocs (extra 'dev')")
from docs import _gallery as gallery

PNG = b"\x89PNG\r\n"


def test_every_part_has_a_picture_what_makes_it_and_a_page() -> None:
    parts = gallery.sections(gallery.PAGE.read_text(encoding="utf-8"))
    assert len(parts) > 5
    for part in parts:
        (name,) = re.findall(r"^!\[[^]]+\]\(gallery/(.+\.png)\)$", part, re.M)
        assert name.split("/")[0].split(".")[0] in part.split("```")[1]
        assert re.search(r"\]\(\w[\w-]*\.md(#[\w-]+)?\)", part), part


def test_a_part_makes_its_picture() -> None:
    pytest.importorskip("PIL", reason="needs pillow (extra 'view')")
    (elbow,) = (
        part
        for part in gallery.sections(gallery.PAGE.read_text(encoding="utf-8"))
        if "elbow.png" in part
    )
    name, picture = gallery.made(elbow)
    assert name == "elbow.png" and picture.startswith(PNG)


def test_every_picture_is_in_the_repository_and_small() -> None:
    names = [
        gallery.name_of(part) for part in gallery.sections(gallery.PAGE.read_text(encoding="utf-8"))
    ]
    files = {path.relative_to(gallery.FOLDER).as_posix() for path in gallery.FOLDER.rglob("*.png")}
    assert files == {*names}
    for name in names:
        picture = (gallery.FOLDER / name).read_bytes()
        assert picture.startswith(PNG) and len(picture) < 150_000


def test_pictures_are_shrunk() -> None:
    image = pytest.importorskip("PIL.Image", reason="needs pillow (extra 'view')")
    import io

    out = io.BytesIO()
    image.new("RGB", (1800, 90), "white").save(out, format="png")
    assert image.open(io.BytesIO(gallery.shrink(out.getvalue()))).size == (900, 45)
