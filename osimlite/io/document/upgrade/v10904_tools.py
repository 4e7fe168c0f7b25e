"""To 10904: the controllers of a tool stand in a set."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import Draft, Element, plain, step

_SPRINGS = [
    f"body{number}_{kind}_corrective_spring_active"
    for number in (1, 2)
    for kind in ("linear", "torsional")
]


@step(below=10904)
def tool_controls(draft: Draft) -> None:
    """The <controls_file> of a tool is read by a ControlSetController; a CorrectionController does what springs did."""
    for tool in draft.every("AbstractTool"):
        file = tool.find("controls_file")
        if file is not None:
            if plain(file) not in ("", "Unassigned"):
                draft.move(
                    file, draft.add(_controllers(draft, tool), "ControlSetController", source=file)
                )
            else:
                draft.remove(file)
            draft.changed(tool)
        spring = next((result for tag in _SPRINGS if (result := tool.find(tag)) is not None), None)
        if spring is not None and tool.tag == "ForwardTool":
            controller = draft.add(_controllers(draft, tool), "CorrectionController", source=spring)
            draft.add(controller, "kp", "16", source=spring)
            draft.add(controller, "kv", "8", source=spring)
            draft.changed(
                tool, at=spring, lost="corrective springs, whose place a CorrectionController takes"
            )
            for tag in _SPRINGS:
                for child in tool.findall(tag):
                    draft.remove(child)


def _controllers(draft: Draft, tool: Element) -> Element:
    controllers = tool.find("ControllerSet")
    if controllers is None:
        controllers = draft.add(tool, "ControllerSet", source=tool, name="Controllers")
    return draft.list_in(controllers, "objects", source=controllers)
