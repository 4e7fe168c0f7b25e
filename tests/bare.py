"""Virtual environment with only the base dependencies of osimlite, created in a moment and without a network.

It has no pip. Its packages are links to those of the environment that runs the tests. All other
packages are absent for Python itself: no import system is patched, and no function is replaced.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import venv
from collections.abc import Iterator, Sequence
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parent.parent
CONSOLE_SCRIPT = "import sys; from osimlite.cli import main; sys.exit(main())"


class BareEnvironment:
    """Virtual environment with osimlite from this repository and the packages of some of its extras.

    Attributes:
        python: interpreter of the environment.
    """

    def __init__(self, folder: Path, extras: Sequence[str] = ()) -> None:
        venv.create(folder, with_pip=False, symlinks=os.name != "nt")
        scripts, name = ("Scripts", "python.exe") if os.name == "nt" else ("bin", "python")
        self.python = folder / scripts / name
        packages = Path(self._ask("import sysconfig; print(sysconfig.get_path('purelib'))"))
        for distribution in find_distributions(extras):
            _link_distribution(distribution, packages)
        # `doctor` reads the extras from the metadata.
        _link_distribution(metadata.distribution("osimlite"), packages, only_metadata=True)
        (packages / "osimlite.pth").write_text(f"{ROOT}\n", encoding="utf-8")

    def _ask(self, script: str) -> str:
        done = subprocess.run(
            [self.python, "-c", script], check=True, capture_output=True, text=True
        )
        return done.stdout.strip()

    def call(
        self, *words: object, folder: Path, code: str = CONSOLE_SCRIPT
    ) -> subprocess.CompletedProcess[str]:
        """Run the command `osimlite` of the environment in a folder.

        Args:
            words: arguments of the command.
            folder: working folder.
            code: Python code that is run instead of the command.

        Returns:
            The finished process.
        """
        return subprocess.run(
            [self.python, "-c", code, *map(str, words)],
            capture_output=True,
            text=True,
            encoding="utf-8",
            cwd=folder,
            check=False,
            timeout=120,
            env=_clean_environment(),
        )

    def start(self, *words: object, folder: Path) -> subprocess.Popen[bytes]:
        """Start the command `osimlite` of the environment in a folder, with pipes as its input and output."""
        return subprocess.Popen(
            [self.python, "-c", CONSOLE_SCRIPT, *map(str, words)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            cwd=folder,
            env=_clean_environment(),
        )


def _clean_environment() -> dict[str, str]:
    """Return the environment variables without those that lead to packages outside the environment."""
    hidden = ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV")
    return {name: value for name, value in os.environ.items() if name not in hidden} | {
        "COLUMNS": "200"
    }


def find_distributions(extras: Sequence[str] = ()) -> Iterator[metadata.Distribution]:
    """Yield the installed distributions that osimlite and some of its extras require, directly or indirectly."""
    seen: set[tuple[str, str]] = set()
    pending = [("osimlite", extra) for extra in ("", *extras)]
    yielded = {"osimlite"}
    while pending:
        name, extra = pending.pop()
        if (name, extra) in seen:
            continue
        seen.add((name, extra))
        distribution = metadata.distribution(name)
        if name not in yielded:
            yielded.add(name)
            yield distribution
        for text in distribution.requires or []:
            requirement = Requirement(text)
            if requirement.marker is None or requirement.marker.evaluate({"extra": extra}):
                pending += [(requirement.name.lower(), more) for more in ("", *requirement.extras)]


def _link_distribution(
    distribution: metadata.Distribution, packages: Path, *, only_metadata: bool = False
) -> None:
    """Link the folders and modules of a distribution into a folder of packages."""
    names = {
        file.parts[0]
        for file in distribution.files or []
        if file.parts[0] not in ("..", "__pycache__")
    }
    for name in sorted(names):
        if only_metadata and not name.endswith(".dist-info"):
            continue
        source, target = Path(str(distribution.locate_file(name))), packages / name
        if target.exists() or not source.exists():
            continue
        try:
            target.symlink_to(source, target_is_directory=source.is_dir())
        except OSError:
            # Windows lets only some users create links.
            (shutil.copytree if source.is_dir() else shutil.copy2)(source, target)


if __name__ == "__main__":
    print(BareEnvironment(Path(sys.argv[1]), sys.argv[2:]).python)
