"""Make the pictures of the gallery by the lines below them.

    python docs/_gallery.py [WORD ...]     all pictures, or those whose names contain a WORD

The pictures are tracked, small PNG files in ``docs/gallery``, so that a clone and the site show them,
and a build of the site computes none. Run this after a change of what they show, and look at them.
"""

from __future__ import annotations

import io
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

PAGE = Path(__file__).with_name("gallery.md")
FOLDER = PAGE.parent / "gallery"
COMPARED = "Before and after\n"
"""Heading of the part with pictures of an earlier version."""
MAX_WIDTH = 900
"""Largest width of a picture, pixels."""
COLORS = 128
"""Colors of a picture; more make the file larger, and look the same."""


def sections(text: str) -> list[str]:
    """Return the parts of the page, each of which makes its picture in a folder of its own.

    The part "Before and after" is made by `docs/_compare.py`.
    """
    parts = re.split(r"^## ", text, flags=re.M)[1:]
    return [part for part in parts if not part.startswith(COMPARED)]


def name_of(section: str) -> str:
    """Return the file name of the picture of a section."""
    (name,) = re.findall(r"\]\(gallery/([^)]+)\)", section)
    return str(name)


def made(section: str) -> tuple[str, bytes]:
    """Return name and bytes of the picture that the blocks of a section make."""
    name = name_of(section)
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", "")))
    with TemporaryDirectory() as folder:
        for language, code in re.findall(r"^```(sh|python)\n(.*?)^```", section, re.M | re.S):
            command = (
                [sys.executable, "-c", code] if language == "python" else ["bash", "-euc", code]
            )
            environment = {
                **os.environ,
                "PATH": path,
                "MPLBACKEND": "Agg",
                "PYTHONPATH": str(PAGE.parents[1]),
            }
            subprocess.run(
                command, cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL
            )
        return name, (Path(folder) / name).read_bytes()


def shrink(picture: bytes) -> bytes:
    """Return a picture as a small PNG file."""
    from PIL import Image

    image = Image.open(io.BytesIO(picture)).convert("RGB")
    if image.width > MAX_WIDTH:
        image = image.resize((MAX_WIDTH, round(image.height * MAX_WIDTH / image.width)))
    out = io.BytesIO()
    image.quantize(COLORS).save(out, format="png", optimize=True)
    return out.getvalue()


def write_pictures(words: list[str]) -> None:
    """Make the pictures whose names contain one of the words, or all, and write them."""
    parts = [
        part
        for part in sections(PAGE.read_text(encoding="utf-8"))
        if not words or any(word in name_of(part) for word in words)
    ]
    with ThreadPoolExecutor(2) as pool:
        for line in pool.map(write_picture, parts):
            print(line, flush=True)


def write_picture(section: str) -> str:
    """Make the picture of a section, write it, and return a line about it."""
    name, picture = made(section)
    path = FOLDER / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(shrink(picture))
    return f"wrote {path} ({path.stat().st_size / 1000.0:.0f} kB)"


if __name__ == "__main__":
    write_pictures(sys.argv[1:])
