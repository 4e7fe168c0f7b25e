"""The kits for public projects: patches that git reads, workflows that fit the action, pages that name them."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from osimlite.lint.settings import settings_for

ROOT = Path(__file__).resolve().parents[2]
KITS = sorted(path.parent for path in (ROOT / "docs" / "adoption").glob("*/README.md"))
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
        done = subprocess.run([git, "apply", "--numstat", patch], capture_output=True, text=True, check=True)
        added, removed = (sum(int(line.split("\t")[place]) for line in done.stdout.splitlines()) for place in (0, 1))
        assert 0 < added + removed < 100


@each_kit
def test_the_workflow_gives_the_action_what_it_takes(kit, repo):
    yaml = pytest.importorskip("yaml", reason="needs PyYAML (extra 'yaml')")
    text = (kit / "models.yml").read_text(encoding="utf-8")
    *_, step = yaml.safe_load(text)["jobs"]["validate"]["steps"]
    assert len(text.splitlines()) == 11 and step["uses"].startswith("OWNER/osimlite@")
    if not (repo / "action.yml").exists():
        pytest.skip("action.yml is in the repository only")
    assert step["with"].keys() <= yaml.safe_load((repo / "action.yml").read_text(encoding="utf-8"))["inputs"].keys()


@each_kit
def test_the_settings_are_read(kit):
    assert "OSIM63" in settings_for(kit).ignore
