"""The pictures of the gallery, made by the lines below them when the site is built. A hook of MkDocs.

The environment variable ``OSIMLITE_MANUAL=quick`` builds the site with empty files in their place.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

PAGE = Path(__file__).with_name("gallery.md")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pictures."""
    make = leave_empty if os.environ.get("OSIMLITE_MANUAL") == "quick" else made
    with ThreadPoolExecutor(2) as pool:
        for name, picture in pool.map(make, sections(PAGE.read_text(encoding="utf-8"))):
            files.append(File.generated(config, f"gallery/{name}", content=picture))
    return files


def sections(text: str) -> list[str]:
    """The parts of the page, each of which makes its picture in a folder of its own."""
    return re.split(r"^## ", text, flags=re.M)[1:]


def name_of(section: str) -> str:
    """Return the file name of the picture of a section."""
    (name,) = re.findall(r"\]\(gallery/([^)]+)\)", section)
    return str(name)


def leave_empty(section: str) -> tuple[str, bytes]:
    """Return the name of the picture of a section, and no bytes."""
    return name_of(section), b""


def made(section: str) -> tuple[str, bytes]:
    """Name and bytes of the picture that the blocks of a section make."""
    name = name_of(section)
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", "")))
    with TemporaryDirectory() as folder:
        for language, code in re.findall(r"^```(sh|python)\n(.*?)^```", section, re.M | re.S):
            command = (
                [sys.executable, "-c", code] if language == "python" else ["bash", "-euc", code]
            )
            environment = {**os.environ, "PATH": path, "MPLBACKEND": "Agg"}
            subprocess.run(
                command, cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL
            )
        return name, (Path(folder) / name).read_bytes()
