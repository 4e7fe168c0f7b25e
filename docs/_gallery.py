"""Make the pictures of the gallery with the commands and scripts below them.

    python docs/_gallery.py [WORD ...]     all pictures, or those whose names contain a WORD

The pictures are small PNG files in ``docs/gallery``. They are tracked, so that clones and the site
show them, and building the site computes none. Run this after a change of what they show, and look
at them.
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
COMPARISON = "Before and after\n"
"""Heading of the section with pictures of an earlier version."""
MAX_WIDTH = 900
"""Largest width of a picture, pixels."""

# More colors make the files larger, and look the same.
COLORS = 128
"""Number of colors of a picture."""

WORKERS = 2
"""Number of pictures that are made at a time."""


def find_sections(text: str) -> list[str]:
    """Return the sections of the page, each with a picture of its own.

    The section "Before and after" is omitted; `docs/_compare.py` makes its pictures.
    """
    sections = re.split(r"^## ", text, flags=re.M)[1:]
    return [section for section in sections if not section.startswith(COMPARISON)]


def find_picture_name(section: str) -> str:
    """Return the file name of the picture of a section."""
    # Each section has exactly one picture.
    (name,) = re.findall(r"\]\(gallery/([^)]+)\)", section)
    return str(name)


def make_picture(section: str) -> tuple[str, bytes]:
    """Run the code blocks of a section in an empty folder.

    Args:
        section: text of the section.

    Returns:
        File name and content of the picture that the blocks make.
    """
    name = find_picture_name(section)
    # The commands of this environment come first, also where it is not activated.
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", "")))
    environment = {
        **os.environ,
        "PATH": path,
        "MPLBACKEND": "Agg",
        "PYTHONPATH": str(PAGE.parents[1]),
    }
    with TemporaryDirectory() as folder:
        for language, code in re.findall(r"^```(sh|python)\n(.*?)^```", section, re.M | re.S):
            if language == "python":
                command = [sys.executable, "-c", code]
            else:
                command = ["bash", "-euc", code]
            subprocess.run(
                command, cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL
            )
        return name, (Path(folder) / name).read_bytes()


def shrink_picture(picture: bytes) -> bytes:
    """Return the content of a small PNG file with the same picture."""
    from PIL import Image

    image = Image.open(io.BytesIO(picture)).convert("RGB")
    if image.width > MAX_WIDTH:
        image = image.resize((MAX_WIDTH, round(image.height * MAX_WIDTH / image.width)))
    out = io.BytesIO()
    image.quantize(COLORS).save(out, format="png", optimize=True)
    return out.getvalue()


def write_pictures(words: list[str]) -> None:
    """Make and write the pictures whose names contain one of the words, or all without words."""
    sections = [
        section
        for section in find_sections(PAGE.read_text(encoding="utf-8"))
        if not words or any(word in find_picture_name(section) for word in words)
    ]
    with ThreadPoolExecutor(WORKERS) as pool:
        for line in pool.map(write_picture, sections):
            print(line, flush=True)


def write_picture(section: str) -> str:
    """Make the picture of a section, write it, and return a line about it."""
    name, picture = make_picture(section)
    path = FOLDER / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(shrink_picture(picture))
    return f"wrote {path} ({path.stat().st_size / 1000.0:.0f} kB)"


if __name__ == "__main__":
    write_pictures(sys.argv[1:])
