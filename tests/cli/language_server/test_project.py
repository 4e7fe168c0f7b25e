"""Tests of the language server on setup files and tables: names refer to the model of a tool and to its data."""

from __future__ import annotations

import gzip
from pathlib import Path
from shutil import copy

import pytest
from lsprotocol import types

from osimlite.cli.language_server.analysis import DocumentAnalysis
from osimlite.cli.language_server.project import Project
from osimlite.cli.language_server.text import Text
from osimlite.io.document.reader import read
from osimlite.lint import validate

ERROR = types.DiagnosticSeverity.Error


@pytest.fixture
def folder(fixtures: Path, tmp_path: Path) -> Path:
    for file in (fixtures / "setups").glob("*.*"):
        if file.suffix != ".gz":
            copy(file, tmp_path)
    (tmp_path / "model.osim").write_bytes(
        gzip.decompress((fixtures / "setups" / "model.osim.gz").read_bytes())
    )
    return tmp_path


@pytest.fixture
def ask(client):
    """Return an object that requests definition, hover text, completions and references at a position."""

    class Ask:
        async def definition(self, file, *place):
            asked = types.DefinitionParams(file.document, file.place(*place))
            return await client.text_document_definition_async(asked)

        async def hover(self, file, *place) -> str:
            found = await client.text_document_hover_async(
                types.HoverParams(file.document, file.place(*place))
            )
            return "" if found is None else found.contents.value

        async def completion(self, file, *place) -> dict[str, types.CompletionItem]:
            asked = types.CompletionParams(file.document, file.place(*place))
            return {
                item.label: item
                for item in (await client.text_document_completion_async(asked)).items
            }

        async def references(self, file, *place) -> list[types.Location]:
            context = types.ReferenceContext(include_declaration=True)
            asked = types.ReferenceParams(context, file.document, file.place(*place))
            return await client.text_document_references_async(asked)

        async def rename(self, file, name, *place) -> dict[str, list[types.TextEdit]]:
            edit = await client.text_document_rename_async(
                types.RenameParams(file.document, file.place(*place), name)
            )
            return edit.changes

    return Ask()


@pytest.mark.asyncio(loop_scope="module")
async def test_a_task_names_a_marker_of_the_model(editor, ask, folder: Path) -> None:
    ik, model = editor(folder / "ik.xml"), editor(folder / "model.osim")
    assert not [d for d in await ik.open() if d.severity == ERROR]
    place = 'IKMarkerTask name="R.ASIS"', 22
    found = await ask.definition(ik, *place)
    assert found.uri == model.uri and model.words(found.range) == "R.ASIS"
    assert "<Marker name=" in model.text.splitlines()[found.range.start.line]
    assert "Marker `/markerset/R.ASIS` of `model.osim`; in `walk.trc`" in await ask.hover(
        ik, *place
    )
    names = await ask.completion(ik, *place)
    assert {"R.ASIS", "L.ASIS"} <= {*names} and "pelvis" not in names
    assert names["R.ASIS"].detail == "Marker /markerset/R.ASIS, in walk.trc"
    lost = next(name for name, item in names.items() if ", not in walk.trc" in item.detail)
    assert names[lost].sort_text > names["R.ASIS"].sort_text
    file = await ask.definition(ik, "walk.trc", 3)
    assert file.uri.endswith("/walk.trc")
    assert "walk.trc" in await ask.completion(ik, "walk.trc", 1)


@pytest.mark.asyncio(loop_scope="module")
async def test_a_misspelt_marker_is_mended_or_ignored(client, editor, folder: Path) -> None:
    ik = editor(folder / "ik.xml")
    await ik.open()
    found = [
        d
        for d in await ik.type('IKMarkerTask name="R.ASIS"', 'IKMarkerTask name="R.ASSIS"')
        if d.code == "OSIM831"
    ]
    context = types.CodeActionContext(found, only=[types.CodeActionKind.QuickFix])
    asked = types.CodeActionParams(ik.document, found[0].range, context)
    actions = await client.text_document_code_action_async(asked)
    texts = [ik.after(action.edit.changes[ik.uri]) for action in actions]
    assert any('IKMarkerTask name="R.ASIS"' in text for text in texts)
    assert any("<!-- osimlite: ignore OSIM831 -->" in text for text in texts)


@pytest.mark.asyncio(loop_scope="module")
async def test_what_an_open_model_says_counts_before_it_is_written(
    client, editor, folder: Path
) -> None:
    ik, model = editor(folder / "ik.xml"), editor(folder / "model.osim")
    await ik.open()
    await model.open()
    await model.type('<Marker name="R.ASIS"', '<Marker name="RASI"')
    found = [d for d in await ik.checked() if d.code == "OSIM831"]
    assert [ik.words(d.range) for d in found] == ["R.ASIS"]
    # While its text is not well-formed, the last valid version of the model counts.
    await model.type('<Marker name="RASI"', '<Marker name="RASI')
    await model.type('<Marker name="RASI', '<Marker name="R.ASIS"')
    assert not [d for d in await ik.checked() if d.code == "OSIM831"]
    await model.type('<Marker name="R.ASIS"', '<Marker name="RASI"')
    assert [d for d in await ik.checked() if d.code == "OSIM831"]
    client.text_document_did_close(types.DidCloseTextDocumentParams(model.document))
    await ik.checked()
    assert not [d for d in await ik.checked() if d.code == "OSIM831"]


def test_what_is_held_needs_no_encoding(tmp_path: Path) -> None:
    file = tmp_path / "m.osim"
    head = '<?xml version="1.0" encoding="ISO-8859-1"?>'
    text = f'{head}<OpenSimDocument Version="40600"><Model name="é"/></OpenSimDocument>'
    file.write_text(text, encoding="iso-8859-1")
    project = Project()
    project.open["m"] = DocumentAnalysis(Text(text.replace("é", "öß")), str(file))
    assert project.publish_unsaved(project.open["m"]) and not project.publish_unsaved(
        project.open["m"]
    )
    assert read(file).name == "öß"
    project.close("m")
    assert read(file).name == "é"


@pytest.mark.asyncio(loop_scope="module")
async def test_a_marker_is_renamed_in_the_model_and_in_setups(editor, ask, folder: Path) -> None:
    ik, model, scale = (editor(folder / name) for name in ("ik.xml", "model.osim", "scale.xml"))
    await ik.open()
    uses = await ask.references(ik, 'IKMarkerTask name="R.ASIS"', 22)
    assert {use.uri for use in uses} == {ik.uri, model.uri, scale.uri}
    await model.open()
    assert {use.uri for use in await ask.references(model, '<Marker name="R.ASIS"', 16)} == {
        use.uri for use in uses
    }
    changes = await ask.rename(ik, "RASI", 'IKMarkerTask name="R.ASIS"', 22)
    assert '<IKMarkerTask name="RASI">' in ik.after(changes[ik.uri])
    assert '<Marker name="RASI">' in model.after(changes[model.uri])
    assert "<markers>RASI L.ASIS</markers>" in scale.after(changes[scale.uri])
    with pytest.raises(Exception, match=r"has a 'L\.ASIS' already"):
        await ask.rename(ik, "L.ASIS", 'IKMarkerTask name="R.ASIS"', 22)


@pytest.mark.asyncio(loop_scope="module")
async def test_loads_name_bodies_and_columns(editor, ask, folder: Path) -> None:
    loads = editor(folder / "loads.xml")
    await loads.open()
    bodies = await ask.completion(loads, "calcn_r</", 3)
    assert {"calcn_r", "calcn_l"} <= {*bodies} and "R.ASIS" not in bodies
    prefixes = await ask.completion(loads, "ground_force_v", 3)
    assert prefixes["ground_force_v"].detail == "ground_force_vx ground_force_vy ground_force_vz"
    assert (await ask.definition(loads, "calcn_r</", 3)).uri.endswith("/model.osim")
    column = await ask.definition(loads, "ground_force_v</", 3)
    data = (folder / "grf.mot").read_text().splitlines()[column.range.start.line]
    assert column.uri.endswith("/grf.mot") and data[column.range.start.character :].startswith(
        "ground_force_vx"
    )


@pytest.mark.asyncio(loop_scope="module")
async def test_files_and_words_that_a_property_takes(editor, ask, folder: Path) -> None:
    inverse = editor(folder / "id.xml")
    await inverse.open()
    files = await ask.completion(inverse, "loads.xml", 2)
    assert (
        files["loads.xml"].sort_text < files["controls.xml"].sort_text and "coords.mot" not in files
    )
    assert {"MUSCLES", "hamstrings_r"} <= {*await ask.completion(inverse, "Muscles<", 2)}
    assert {"ALL", "hip_r"} <= {*await ask.completion(inverse, "ALL<", 2)}


@pytest.mark.asyncio(loop_scope="module")
async def test_a_set_in_a_file_of_its_own(editor, ask, folder: Path) -> None:
    text = (folder / "ik.xml").read_text()
    tasks = text[text.index("<IKTaskSet>") : text.index("</IKTaskSet>") + len("</IKTaskSet>")]
    (folder / "ik.xml").write_text(text.replace(tasks, '<IKTaskSet name="t" file="tasks.xml"/>'))
    (folder / "tasks.xml").write_text(f'<OpenSimDocument Version="40600">{tasks}</OpenSimDocument>')
    ik, own = editor(folder / "ik.xml"), editor(folder / "tasks.xml")
    await ik.open()
    await own.open()
    assert (await ask.definition(ik, "tasks.xml", 2)).uri == own.uri
    assert await ask.definition(ik, '"t"', 1) == await ask.definition(ik, "tasks.xml", 2)
    assert (await ask.definition(own, "R.ASIS", 2)).uri.endswith("/model.osim")
    assert "in `walk.trc`" in await ask.hover(own, "R.ASIS", 2)


@pytest.mark.asyncio(loop_scope="module")
async def test_controls_are_called_after_actuators(editor, ask, folder: Path) -> None:
    controls = editor(folder / "controls.xml")
    await controls.open()
    assert "hamstrings_r" in await ask.completion(controls, "hamstrings_r.exc", 3)


MOCO = """<OpenSimDocument Version="40600">
    <MocoStudy name="study"><MocoProblem name="problem"><MocoPhase name="phases"><phases><MocoPhase>
        <ModelProcessor name="model"><filepath>model.osim</filepath></ModelProcessor>
        <state_infos><MocoVariableInfo name="/jointset/knee_r/knee_angle_r/value"/></state_infos>
        <control_infos><MocoVariableInfo name="/forceset/hamstrings_r"/></control_infos>
        <goals><MocoControlGoal name="effort"><MocoWeightSet name="control_weights"><objects>
            <MocoWeight name="/forceset/vasti_r"/></objects></MocoWeightSet></MocoControlGoal></goals>
    </MocoPhase></phases></MocoPhase></MocoProblem></MocoStudy>
</OpenSimDocument>
"""


@pytest.mark.asyncio(loop_scope="module")
async def test_states_and_controls_of_moco_are_paths(editor, ask, folder: Path) -> None:
    text = MOCO.replace('<MocoPhase name="phases"><phases>', "<phases>").replace(
        "</phases></MocoPhase>", "</phases>"
    )
    study = editor(folder / "study.omoco", text)
    await study.open()
    states = await ask.completion(study, "/jointset/knee_r", 3)
    assert (
        "/jointset/knee_r/knee_angle_r/speed" in states and "/forceset/hamstrings_r" not in states
    )
    controls = await ask.completion(study, "/forceset/hamstrings_r", 3)
    assert (
        "/forceset/hamstrings_r" in controls
        and "/jointset/knee_r/knee_angle_r/speed" not in controls
    )
    assert "/forceset/hamstrings_r" in await ask.completion(study, "/forceset/vasti_r", 3)
    assert "Coordinate `/jointset/knee_r/knee_angle_r` of" in await ask.hover(
        study, "/jointset/knee_r", 3
    )
    (folder / "study.omoco").write_text(text)
    changes = await ask.rename(study, "knee", "/jointset/knee_r", 3)
    assert "/jointset/knee_r/knee/value" in study.after(changes[study.uri])


@pytest.mark.asyncio(loop_scope="module")
async def test_outline_and_layout_of_a_setup(client, editor, folder: Path) -> None:
    inverse = editor(folder / "id.xml")
    await inverse.open()
    (tool,) = await client.text_document_document_symbol_async(
        types.DocumentSymbolParams(inverse.document)
    )
    assert (tool.name, tool.detail) == ("walk_subject", "InverseDynamicsTool")
    options = types.FormattingOptions(tab_size=4, insert_spaces=False)
    await inverse.type("\t\t<time_range>0.5 1", "<time_range>0.5   1")
    edits = await client.text_document_formatting_async(
        types.DocumentFormattingParams(inverse.document, options)
    )
    assert "\t\t<time_range> 0.5 1</time_range>" in inverse.after(edits)


@pytest.mark.asyncio(loop_scope="module")
async def test_a_table_is_checked_when_it_is_written(client, editor, folder: Path) -> None:
    motion = editor(folder / "coords.mot")
    assert not await motion.open()
    motion.replace("inDegrees=yes", "inDegrees=true")
    # Requests are answered during the delay before a check, and the check comes after the answer.
    edits = await client.text_document_formatting_async(
        types.DocumentFormattingParams(motion.document, types.FormattingOptions(4, False))
    )
    assert not edits and not client.diagnostics[motion.uri]
    motion.save()
    (found,) = await motion.checked()
    assert motion.words(found.range) == "true"
    context = types.CodeActionContext([found], only=[types.CodeActionKind.QuickFix])
    asked = types.CodeActionParams(motion.document, found.range, context)
    actions = await client.text_document_code_action_async(asked)
    texts = [motion.after(action.edit.changes[motion.uri]) for action in actions]
    assert any("inDegrees=yes" in text for text in texts)
    ignored = next(text for text in texts if "osimlite: ignore OSIM803\nendheader" in text)
    (folder / "coords.mot").write_text(ignored)
    assert not validate(folder / "coords.mot").findings


@pytest.mark.asyncio(loop_scope="module")
async def test_a_mend_in_a_table_is_where_it_belongs_behind_letters_of_any_script(
    client, editor, folder: Path
) -> None:
    text = (folder / "coords.mot").read_text()
    rest = text.partition("\n")[2]
    motion = editor(
        folder / "coords.mot",
        f"Läufer \U0001f3c3\n{rest.replace('inDegrees=yes', 'inDegrees=true')}",
    )
    (found,) = await motion.open()
    context = types.CodeActionContext([found], only=[types.CodeActionKind.QuickFix])
    asked = types.CodeActionParams(motion.document, found.range, context)
    mend = next(
        action
        for action in await client.text_document_code_action_async(asked)
        if action.title == "Change to 'yes'"
    )
    assert motion.after(mend.edit.changes[motion.uri]) == f"Läufer \U0001f3c3\n{rest}"


@pytest.mark.asyncio(loop_scope="module")
async def test_a_class_of_a_plugin_is_offered_where_the_project_has_it(
    editor, ask, folder: Path
) -> None:
    classes = '{"classes": {"DragForce": {"bases": ["Force"], "properties": [{"name": "gain", "type": "double"}]}}}'
    setup = '<ForceSet name="f">\n<objects>\n<DragForce name="d">\n<gain>1</gain>\n<\n</DragForce>\n</objects>\n</ForceSet>'
    text = f'<OpenSimDocument Version="40600">\n{setup}\n</OpenSimDocument>\n'
    ours, others = folder / "ours", folder / "others"
    for place in (ours, others):
        place.mkdir()
    (ours / "classes.json").write_text(classes)
    (ours / "osimlite.toml").write_text('classes = ["classes.json"]\n')
    mine, theirs = editor(ours / "forces.xml", text), editor(others / "forces.xml", text)
    await mine.open()
    await theirs.open()
    for _ in range(2):
        assert "appliesForce" in await ask.completion(mine, "<\n", 1)
        assert "appliesForce" not in await ask.completion(theirs, "<\n", 1)
    assert "gain" in await ask.hover(mine, "gain>", 1)


@pytest.mark.asyncio(loop_scope="module")
async def test_xml_of_others_is_left_alone(client, editor, ask, tmp_path: Path) -> None:
    pom = editor(
        tmp_path / "pom.xml", "<project>\n  <Body name='a'><mass>1</mass></Body>\n  <\n</project>"
    )
    assert await pom.open() == []
    assert await ask.hover(pom, "mass", 1) == "" and await ask.completion(pom, "<\n", 1) == {}
    assert await ask.definition(pom, "Body", 1) is None
    folds = await client.text_document_folding_range_async(types.FoldingRangeParams(pom.document))
    assert not folds
