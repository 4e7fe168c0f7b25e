"""Tests of the language server as a client uses it, over standard input and output."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from lsprotocol import types


@pytest.fixture
def walker(editor, fixtures: Path, tmp_path: Path):
    text = (fixtures / "walker" / "DynamicWalkerModel.osim").read_text()
    return editor(tmp_path / "walker.osim", text)


@pytest.mark.asyncio(loop_scope="module")
async def test_a_misspelt_contact_name_is_underlined_and_mended(client, walker) -> None:
    before = await walker.open()
    assert not [found for found in before if found.severity == types.DiagnosticSeverity.Error]
    found = [
        d
        for d in await walker.type("RFootContact Platform", "RFotContact Platform")
        if d.code == "OSIM301"
    ]
    assert [walker.words(d.range) for d in found] == ["RFotContact"]
    assert "did you mean 'RFootContact'" in found[0].message
    context = types.CodeActionContext(diagnostics=found, only=[types.CodeActionKind.QuickFix])
    asked = types.CodeActionParams(walker.document, found[0].range, context)
    actions = await client.text_document_code_action_async(asked)
    mend = next(action for action in actions if "RFootContact" in action.title)
    assert "RFootContact Platform" in walker.after(mend.edit.changes[walker.uri])
    # Actions are offered for every cursor position in the line.
    for column in (0, found[0].range.end.character + 3):
        place = types.Position(found[0].range.start.line, column)
        asked = types.CodeActionParams(walker.document, types.Range(place, place), context)
        again = await client.text_document_code_action_async(asked)
        assert mend.title in [action.title for action in again]


@pytest.mark.skipif(sys.platform == "win32", reason="needs signals as POSIX has them")
def test_ctrl_c_ends_the_server_at_once_with_a_sentence() -> None:
    command = [sys.executable, "-m", "osimlite", "lsp"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True) as server:
        # The signal must arrive when the server has started and reads from the editor.
        time.sleep(2.0)
        server.send_signal(signal.SIGINT)
        assert server.wait(5.0) in (130, -signal.SIGINT)
        assert server.stderr is not None and "Traceback" not in server.stderr.read()


@pytest.mark.asyncio(loop_scope="module")
async def test_a_file_that_is_broken_at_the_moment(client, walker) -> None:
    await walker.open()
    found = await walker.type("<mass>1</mass>", "<mass>1</mas")
    assert next(d.code for d in found if d.severity == types.DiagnosticSeverity.Error) == "OSIM001"
    hover = await client.text_document_hover_async(
        types.HoverParams(walker.document, walker.place("<mass>", 2))
    )
    assert "**mass**: one number in kg" in hover.contents.value
    await walker.type("<mass>1</mas", "<mass>1</mass>")
    assert not [
        d for d in client.diagnostics[walker.uri] if d.severity == types.DiagnosticSeverity.Error
    ]


@pytest.mark.asyncio(loop_scope="module")
async def test_what_a_word_means(client, walker) -> None:
    await walker.open()

    async def hover(text: str, within: int) -> str:
        asked = types.HoverParams(walker.document, walker.place(text, within))
        found = await client.text_document_hover_async(asked)
        return "" if found is None else found.contents.value

    assert "/forceset/RFootForce" in await hover('<HuntCrossleyForce name="RFootForce"', 3)
    assert "Hertz" in await hover('<HuntCrossleyForce name="RFootForce"', 3)
    velocity = await hover("<transition_velocity>", 4)
    assert "one number in m/s, > 0; by default `0.01`" in velocity
    assert "Slip velocity of static friction" in velocity
    assert "ContactSphere `/contactgeometryset/RFootContact`" in await hover(
        "RFootContact Platform", 4
    )
    assert await hover("<?xml", 2) == ""


@pytest.mark.asyncio(loop_scope="module")
async def test_where_a_name_leads_and_who_uses_it(client, walker) -> None:
    await walker.open()
    here = walker.place("RFootContact Platform", 4)
    found = await client.text_document_definition_async(
        types.DefinitionParams(walker.document, here)
    )
    assert walker.words(found.range) == "RFootContact"
    assert '<ContactSphere name="' in walker.text.splitlines()[found.range.start.line]
    context = types.ReferenceContext(include_declaration=False)
    asked = types.ReferenceParams(context, walker.document, found.range.start)
    uses = await client.text_document_references_async(asked)
    assert uses and all("RFootContact" in walker.words(use.range) for use in uses)
    assert any("<geometry>" in walker.text.splitlines()[use.range.start.line] for use in uses)


@pytest.mark.asyncio(loop_scope="module")
async def test_a_name_is_changed_everywhere(client, walker) -> None:
    await walker.open()
    here = walker.place('<ContactSphere name="RFootContact"', 23)
    shown = await client.text_document_prepare_rename_async(
        types.PrepareRenameParams(walker.document, here)
    )
    assert (walker.words(shown.range), shown.placeholder) == ("RFootContact", "RFootContact")
    edit = await client.text_document_rename_async(
        types.RenameParams(walker.document, here, "heel")
    )
    after = walker.after(edit.changes[walker.uri])
    assert '<ContactSphere name="heel"' in after and "heel Platform" in after
    assert "RFootContact Platform" not in after
    with pytest.raises(Exception, match="its parent has a 'LFootContact' already"):
        await client.text_document_rename_async(
            types.RenameParams(walker.document, here, "LFootContact")
        )


@pytest.mark.asyncio(loop_scope="module")
async def test_what_may_be_written_here(client, walker) -> None:
    await walker.open()

    async def labels(within: str, offset: int) -> list[str]:
        asked = types.CompletionParams(walker.document, walker.place(within, offset))
        found = await client.text_document_completion_async(asked)
        return [item.label for item in found.items]

    names = await labels("RFootContact Platform", 2)
    assert {"RFootContact", "LFootContact"} <= {*names} and "Pelvis" not in names
    await walker.type("<transition_velocity>", "<a/>\n<transition_velocity>")
    await walker.type("<a/>", "<")
    tags = await labels("<\n", 1)
    assert "appliesForce" in tags and "stiffness" not in tags
    await walker.type("<\n", "</\n")
    assert await labels("</\n", 2) == ["HuntCrossleyForce"]


@pytest.mark.asyncio(loop_scope="module")
async def test_outline_folds_and_layout(client, walker) -> None:
    await walker.open()
    (model,) = await client.text_document_document_symbol_async(
        types.DocumentSymbolParams(walker.document)
    )
    assert model.name == "DynamicWalkerModel"
    sets = {child.name: child for child in model.children}
    assert {"Pelvis", "RightThigh"} <= {body.name for body in sets["bodyset"].children}
    folds = await client.text_document_folding_range_async(
        types.FoldingRangeParams(walker.document)
    )
    start = walker.place('<ContactSphere name="RFootContact"').line
    fold = next(fold for fold in folds if fold.start_line == start)
    assert walker.text.splitlines()[fold.end_line].strip() == "</ContactSphere>"
    options = types.FormattingOptions(tab_size=4, insert_spaces=False)
    await walker.type("\t\t\t<objects>", "<objects>")
    edits = await client.text_document_formatting_async(
        types.DocumentFormattingParams(walker.document, options)
    )
    assert "\t\t\t<objects>" in walker.after(edits)


@pytest.mark.asyncio(loop_scope="module")
async def test_layout_of_an_older_format(client, editor, tmp_path: Path) -> None:
    text = '<OpenSimDocument Version="20302"><Model name="m"><gravity> 0 -9.810 0\n</gravity></Model></OpenSimDocument>'
    old = editor(tmp_path / "old.osim", text)
    await old.open()
    options = types.FormattingOptions(tab_size=4, insert_spaces=False)
    edits = await client.text_document_formatting_async(
        types.DocumentFormattingParams(old.document, options)
    )
    assert "\t\t<gravity>0 -9.810 0</gravity>\n" in old.after(
        edits
    ) and 'Version="20302"' in old.after(edits)
