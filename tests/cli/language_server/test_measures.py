"""Tests of slow rules in the language server: they run while nobody types, and keep results that are still valid."""

from __future__ import annotations

import pytest

from osimlite.base.require import find_missing_packages

pytestmark = pytest.mark.skipif(
    bool(find_missing_packages("numpy")), reason="numpy is not installed"
)


def of_paths(diagnostics):
    return sorted(found.message for found in diagnostics if found.code == "OSIM632")


@pytest.mark.asyncio(loop_scope="module")
@pytest.mark.full
async def test_after_a_pause(editor, fixtures, tmp_path) -> None:
    text = (fixtures / "lint" / "OSIM632" / "fail-02-two-coordinates.osim").read_text()
    file = editor(tmp_path / "legs.osim", text)
    assert not of_paths(await file.open())
    found = of_paths(await file.checked())
    assert len(found) == 2
    # No path depends on the radius of a foot: the known findings are reported at once.
    assert of_paths(await file.type("<radius>0.05</radius>", "<radius>0.06</radius>")) == found
    assert not of_paths(await file.type("<range>-2.1 0</range>", "<range>-2.1 0.1</range>"))
    assert len(of_paths(await file.checked())) == 2


@pytest.mark.asyncio(loop_scope="module")
async def test_not_while_somebody_types(editor, fixtures, tmp_path) -> None:
    text = (fixtures / "lint" / "OSIM632" / "fail-02-two-coordinates.osim").read_text()
    file = editor(tmp_path / "legs.osim", text)
    await file.open()
    for number in range(1, 6):
        old = file.text[file.text.index("<mass>") :].partition("\n")[0]
        assert not of_paths(await file.type(old, f"<mass>{number}.5</mass>"))
