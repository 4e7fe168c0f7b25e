"""Tests of the kits for public projects: git reads the patches, workflows fit the action, pages name the kits."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

import osimlite
from osimlite.lint.settings import load_settings

ROOT = Path(__file__).resolve().parents[2]
KITS = sorted(path.parent for path in (ROOT / "docs" / "adoption").glob("*/README.md"))
CLIENTS = sorted((ROOT / "docs" / "adoption").glob("*/client/kinematics.patch"))
each_kit = pytest.mark.parametrize("kit", KITS, ids=lambda kit: kit.name)


def test_the_index_leads_to_every_kit():
    index = (ROOT / "docs" / "adoption" / "index.md").read_text(encoding="utf-8")
    assert set(re.findall(r"\]\(([\w-]+)/README\.md\)", index)) == {kit.name for kit in KITS}
    assert sum(path.stat().st_size for kit in KITS for path in kit.iterdir()) < 300_000


@each_kit
def test_patches_are_sound_and_say_what_opensim_reads(kit):
    git = shutil.which("git")
    if git is None:
        pytest.skip("needs git")
    page = (kit / "README.md").read_text(encoding="utf-8")
    for patch in sorted(kit.glob("*.patch")):
        told, _, _ = patch.read_text(encoding="utf-8").partition("\ndiff --git ")
        assert "\n\nOpenSim 4.6 reads: " in told and f"({patch.name})" in page
        done = subprocess.run(
            [git, "apply", "--numstat", patch], capture_output=True, text=True, check=True
        )
        added, removed = (
            sum(int(line.split("\t")[place]) for line in done.stdout.splitlines())
            for place in (0, 1)
        )
        assert 0 < added + removed < 100


@pytest.mark.parametrize("patch", CLIENTS, ids=lambda patch: patch.parents[1].name)
def test_clients_call_what_there_is(patch):
    """The kit names each patch of a client program, git reads it, and the names of osimlite that it uses exist."""
    git = shutil.which("git")
    if git is None:
        pytest.skip("needs git")
    assert "(client/kinematics.patch)" in (patch.parents[1] / "README.md").read_text(
        encoding="utf-8"
    )
    subprocess.run([git, "apply", "--numstat", patch], capture_output=True, check=True)
    added = [
        line[1:]
        for line in patch.read_text(encoding="utf-8").splitlines()
        if re.match(r"\+(?!\+\+)", line)
    ]
    names = set(re.findall(r"osimlite\.(\w+)", "\n".join(added)))
    assert {"read", "read_document", "write", "run"} <= names <= set(dir(osimlite))
    # Every property that the patched program sets exists in the class of the setup.
    given = set(
        re.findall(
            r"(?:IKTool|scaleTool|modelScaler|markerPlacer)\.(\w+)(?:\.\w+)* = ", "\n".join(added)
        )
    )
    classes = (
        osimlite.ScaleTool,
        osimlite.ModelScaler,
        osimlite.MarkerPlacer,
        osimlite.InverseKinematicsTool,
    )
    assert given <= {name for cls in classes for name in cls.model_fields} and (
        not given or "time_range" in given
    )


@each_kit
def test_the_workflow_gives_the_action_what_it_takes(kit, repo):
    yaml = pytest.importorskip("yaml", reason="needs PyYAML (extra 'yaml')")
    text = (kit / "models.yml").read_text(encoding="utf-8")
    *_, step = yaml.safe_load(text)["jobs"]["validate"]["steps"]
    assert len(text.splitlines()) == 11 and step["uses"].startswith("OWNER/osimlite@")
    if not (repo / "action.yml").exists():
        pytest.skip("action.yml is in the repository only")
    assert (
        step["with"].keys()
        <= yaml.safe_load((repo / "action.yml").read_text(encoding="utf-8"))["inputs"].keys()
    )


@each_kit
def test_the_settings_are_read(kit):
    assert "OSIM63" in load_settings(kit).ignore
