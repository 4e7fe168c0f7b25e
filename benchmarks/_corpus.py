"""The real models that benchmarks read: a folder beside the repository, which not every machine has."""

from __future__ import annotations

import gzip
from pathlib import Path

CORPUS = Path(__file__).resolve().parents[2] / "shared" / "corpus" / "converted"


def unpacked(folder: Path, into: Path) -> list[Path]:
    """The model files of a folder, uncompressed, in another one."""
    files = []
    for path in sorted(folder.glob("*.osim*")):
        target = into / path.name.removesuffix(".gz")
        target.write_bytes(
            gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
        )
        files.append(target)
    return files
