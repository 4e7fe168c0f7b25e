"""Check osimlite with only its base dependencies: commands, hooks and action on models and projects.

Run it with the Python of an environment into which only the wheel is installed:

    ENVIRONMENT/bin/python tests/core_install.py [--models FOLDER] [--all]

It needs no pytest and prints a table of commands by exit codes. It exits with 1 if a command fails,
prints a traceback, or requires a package that it should not need.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SHARED = Path(os.environ.get("OSIMLITE_SHARED", ROOT.parent / "shared"))
# Packages that must be absent: with one of them, the checks would not test the base dependencies
# alone.
OPTIONAL_PACKAGES = (
    "numpy",
    "scipy",
    "numba",
    "matplotlib",
    "PIL",
    "yaml",
    "pygls",
    "mujoco",
    "pandas",
    "pyarrow",
)
PROJECTS = ("pipelines/pendulum", "pipelines/walking", "setups", "documents")
"""Folders of fixtures that are checked as complete projects."""

# Fewer models or projects mean that a folder is missing, and that the checks would pass without a
# test.
MIN_MODELS, MIN_PROJECTS = 12, 3
NOTE = "did not run: they need osimlite[sim]"
"""Sentence in reports about rules that need numerical packages."""

NAMES_AN_EXTRA = {
    ("build", "human-walks", "-o", "study"): "sim",
    ("simulate", "walker.osim"): "sim",
    ("translate", "walker.osim"): "sim",
    ("convert", "walker.osim", "-o", "walker.urdf"): "sim",
    ("muscles", "walker.osim"): "sim",
    ("view", "walker.osim"): "sim",
    ("run", "setup.xml"): "sim",
    ("ik", "walker.osim", "markers.trc"): "sim",
    ("kinematics", "walker.osim", "motion.mot"): "sim",
    ("inverse-dynamics", "walker.osim", "motion.mot"): "sim",
    ("static-optimization", "walker.osim", "motion.mot"): "sim",
    ("scale", "walker.osim", "--mass", "70"): "sim",
    ("modify", "walker.osim", "--replace", "contact=smooth"): "sim",
    ("fit", "walker.osim", "markers.trc"): "sim",
    ("scone", "human-walks"): "sim",
    ("gait", "steady-walker"): "sim",
    ("sweep", "walker.osim", "--vary", "RHip_rz=0:0.1:2"): "sweep",
    ("optimize", "walker.osim", "--objective", "distance", "--vary", "RHip_rz=0:1"): "optimize",
    ("check-trial", "."): "sim",
    ("demo", "-o", "tour"): "sim",
    ("lsp",): "lsp",
    ("build", "walker.yaml", "-o", "yaml.osim"): "yaml",
}
"""Commands that need more than the base dependencies, and the extra that their message must name."""


class Checker:
    """Runner of commands in a working folder, which counts exit codes and collects problems.

    Attributes:
        exit_codes: number of occurrences of each exit code, by command.
        problems: sentences that describe what is wrong.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.exit_codes: dict[str, Counter[int]] = defaultdict(Counter)
        self.problems: list[str] = []
        hidden = ("PYTHONPATH", "PYTHONHOME")
        self._environment = {
            name: value for name, value in os.environ.items() if name not in hidden
        }
        self._environment |= {"COLUMNS": "200", "XDG_CACHE_HOME": str(folder / "cache")}

    def call(
        self, label: str, *words: object, allowed: Iterable[int] = (0, 1)
    ) -> subprocess.CompletedProcess[str]:
        """Run a command, and check its exit code and its output.

        Args:
            label: row of the table.
            words: arguments of `osimlite`.
            allowed: exit codes that are correct.

        Returns:
            The finished process.
        """
        # Use -I as the GitHub action does: nothing is imported from the working folder.
        done = subprocess.run(
            [sys.executable, "-I", "-m", "osimlite", *map(str, words)],
            capture_output=True,
            text=True,
            encoding="utf-8",
            cwd=self.folder,
            env=self._environment,
            timeout=300,
            check=False,
        )
        self.exit_codes[label][done.returncode] += 1
        line = " ".join(["osimlite", *map(str, words)])[:150]
        if done.returncode not in allowed:
            self.problems.append(
                f"{line}: exit code {done.returncode}: {done.stderr.strip()[-300:]}"
            )
        if "Traceback" in done.stderr:
            self.problems.append(f"{line}: {done.stderr.strip()[-300:]}")
        return done

    def check_notes(self, models: Sequence[Path]) -> None:
        """Check that reports on models with muscles name the rules that did not run, in text and in JSON."""
        measurable = [path for path in models if b"Muscle>" in path.read_bytes()]
        for path in measurable[:2]:
            notes = [
                finding
                for finding in json.loads(
                    self.call("validate (notes)", "validate", "--format", "json", path).stdout
                )
                if finding["name"] == "not-measured"
            ]
            if len(notes) != 1 or NOTE not in notes[0]["message"] or notes[0]["file"] != str(path):
                self.problems.append(f"{path}: the JSON report does not say '{NOTE}' once")
            for name in ("full", "concise"):
                if (
                    NOTE
                    not in self.call("validate (notes)", "validate", "--format", name, path).stdout
                ):
                    self.problems.append(f"{path}: the {name} report does not say '{NOTE}'")

    def check_model(self, source: Path, number: int) -> None:
        """Run each command on a copy of a model."""
        folder = self.folder / str(number)
        folder.mkdir()
        model = folder / source.name
        shutil.copyfile(source, model)
        upgraded = folder / "upgraded.osim"
        if self.call("info", "info", model, allowed=(0, 2)).returncode == 2:
            # One file of the corpus is unreadable: the other commands must refuse it too.
            for words in (("format", model), ("upgrade", model, "-o", upgraded)):
                self.call(f"{words[0]} (unreadable)", *words, allowed=(2,))
            return
        self.call("validate", "validate", "--no-cache", "--format", "json", model)
        self.call("upgrade", "upgrade", model, "-o", upgraded, allowed=(0,))
        self.call("diff", "diff", model, upgraded)
        self.call("format (hook)", "format", "--skip-other-xml", model)
        self.call("validate --fix", "validate", "--no-cache", "--fix", model)
        # Formatting and fixing is idempotent: a second run leaves the file as it is.
        self.call("format --check", "format", "--check", model)

    def check_project(self, source: Path) -> None:
        """Check a folder as a user does, and as the pre-commit hook and the GitHub action do."""
        folder = self.folder / f"project-{source.name}"
        shutil.copytree(source, folder)
        self.call("validate FOLDER", "validate", folder)
        files = sorted(
            path
            for path in folder.rglob("*")
            if path.suffix in (".osim", ".xml", ".omoco", ".sto", ".mot")
        )
        self.call("validate (hook)", "validate", "--skip-other-xml", *files)
        action = ("--no-cache", "--skip-other-xml", "--format", "github", "--")
        self.call("validate (action)", "validate", *action, folder)

    def check_built_in_models(self) -> None:
        """Build each built-in model and validate it, and run the commands that need no model."""
        listed = self.call("build --list", "build", "--list", allowed=(0,)).stdout
        for name in (line.split()[0] for line in listed.splitlines() if line[:1].isalpha()):
            if name == "human-walks":
                continue
            self.call("build", "build", name, "-o", f"{name}.osim", allowed=(0,))
            self.call("validate (built)", "validate", f"{name}.osim", allowed=(0,))
        for words in ((), ("--help",), ("--version",), ("rule",), ("rule", "OSIM101"), ("doctor",)):
            self.call("help, rule, doctor", *words, allowed=(0,))

    def check_extras(self) -> None:
        """Check that each command that needs an extra names it in one sentence."""
        self.call("build", "build", "dynamic-walker", "-o", "walker.osim", allowed=(0,))
        for name in ("setup.xml", "markers.trc", "motion.mot", "walker.yaml"):
            (self.folder / name).write_text("")
        for words, extra in NAMES_AN_EXTRA.items():
            done = self.call("needs an extra", *words, allowed=(2,))
            if f"osimlite[{extra}]" not in done.stderr or done.stderr.count("\n") != 1:
                self.problems.append(
                    f"osimlite {' '.join(words)}: names no 'osimlite[{extra}]': {done.stderr[-300:]}"
                )

    def print_table(self) -> None:
        """Print how often each command ended with each exit code."""
        codes = sorted({code for counts in self.exit_codes.values() for code in counts})
        print(f"{'command':24}" + "".join(f"{f'exit {code}':>9}" for code in codes))
        for label, counts in self.exit_codes.items():
            print(f"{label:24}" + "".join(f"{counts[code] or '':>9}" for code in codes))


def find_models(folder: Path, *, everything: bool) -> list[Path]:
    """Return models spread over the shared corpus, or models of the fixtures if there is no corpus."""
    models = sorted(folder.rglob("*.osim"))
    if not models:
        with_joints = [
            path
            for path in ROOT.glob("fixtures/lint/*/*.osim")
            if b"<CustomJoint" in path.read_bytes()
        ]
        with_muscles = [path for path in ROOT.glob("fixtures/lint/OSIM63*/*.osim")]
        models = sorted([*ROOT.glob("fixtures/walker*/*.osim"), *with_joints, *with_muscles])
    return models if everything else models[:: max(1, len(models) // MIN_MODELS)]


def main() -> int:
    """Run all checks and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--models", type=Path, default=SHARED / "corpus" / "models", help="folder of models"
    )
    parser.add_argument(
        "--all", action="store_true", help="all models of the folder, not only a dozen"
    )
    options = parser.parse_args()
    present = [name for name in OPTIONAL_PACKAGES if find_spec(name) is not None]
    if present:
        print(
            f"this environment has {', '.join(present)}: install the wheel alone", file=sys.stderr
        )
        return 2
    models = find_models(options.models, everything=options.all)
    projects = [ROOT / "fixtures" / name for name in PROJECTS]
    assert len(models) >= MIN_MODELS and len(projects) >= MIN_PROJECTS
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as pool:
        checker = Checker(Path(folder).resolve())
        work = [
            pool.submit(checker.check_model, path, number) for number, path in enumerate(models)
        ]
        work += [pool.submit(checker.check_project, path) for path in projects]
        work += [pool.submit(checker.check_notes, models)]
        for each in work:
            each.result()
        checker.check_built_in_models()
        checker.check_extras()
    checker.print_table()
    print(f"{len(models)} models, {len(projects)} projects, {len(checker.problems)} problems")
    for problem in checker.problems:
        print(problem, file=sys.stderr)
    return 1 if checker.problems else 0


if __name__ == "__main__":
    sys.exit(main())
