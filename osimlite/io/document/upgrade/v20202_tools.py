"""To 20001 and 20202: loads in documents of their own, one trial of inverse kinematics, inverse dynamics as a tool."""

from __future__ import annotations

from osimlite.io.document.foreign import is_element
from osimlite.io.document.upgrade.draft import Draft, elements, is_true, step, text_of

_OF_ANALYSES = ("on", "in_degrees", "step_interval", "start_time", "end_time")
_OF_ABSTRACT_TOOL = ("output_precision", "initial_time", "final_time")


@step(below=20001)
def external_loads(draft: Draft) -> None:
    """Measured loads are named with the bodies that they push, which only a document of ExternalLoads can say.

    OpenSim writes that document; here no other file is touched.
    """
    for tool in draft.every("AbstractTool"):
        file = text_of(tool, "external_loads_file") or "Unassigned"
        bodies = [text_of(tool, f"external_loads_body{number}") for number in (1, 2)]
        if file != "Unassigned" and not file.endswith(".xml"):
            pushed = " and ".join(body for body in bodies if body) or "no body"
            draft.changed(
                tool,
                lost=f"external_loads_file {file} pushes {pushed}: write ExternalLoads and name them instead",
            )


@step(below=20202)
def one_trial(draft: Draft) -> None:
    """What the first trial of inverse kinematics says is said by the tool."""
    for tool in draft.tagged("InverseKinematicsTool"):
        trials = tool.find("IKTrialSet")
        result = [] if trials is None else trials.findall("objects/IKTrial")
        if trials is None or not result:
            # A tool at the top, without a document around it, is taken as it is.
            if draft.numbers[tool]:
                draft.refuse(
                    tool,
                    tool,
                    "an InverseKinematicsTool without an IKTrialSet, which old versions had",
                )
            continue
        for child in list(result[0]):
            if is_element(child):
                draft.move(child, tool)
            else:
                tool.append(child)
        for extra in result[1:]:
            draft.changed(tool, at=extra, lost=f"the trial '{extra.get('name', '')}'")
        draft.add(tool, "constraint_weight", "20", source=trials)
        draft.add(tool, "accuracy", "1e-05" if draft.version == 10500 else "0.0001", source=trials)
        optimizer = tool.find("optimizer_algorithm")
        if optimizer is not None:
            draft.remove(optimizer)
        draft.remove(trials)
        draft.changed(tool)


@step(below=20202)
def inverse_dynamics(draft: Draft) -> None:
    """An AnalyzeTool with the analysis InverseDynamics is an InverseDynamicsTool."""
    for tool in draft.tagged("InverseDynamicsTool"):
        if draft.numbers[tool]:
            draft.refuse(
                tool, tool, "an InverseDynamicsTool, which old versions called AnalyzeTool"
            )
    for tool in draft.tagged("AnalyzeTool"):
        analyses = tool.find("AnalysisSet/objects")
        analysis = None if analyses is None else analyses.find("InverseDynamics")
        if analyses is None or analysis is None:
            continue
        uses_forces = is_true(text_of(analysis, "use_model_force_set") or "false")
        times = " ".join(
            text_of(tool, tag) or default
            for tag, default in (("initial_time", "0"), ("final_time", "1"))
        )
        for child in elements(analysis):
            if child.tag not in (*_OF_ANALYSES, "use_model_force_set"):
                draft.move(child, tool)
        for child in elements(tool):
            if child.tag in _OF_ABSTRACT_TOOL:
                draft.remove(child)
        draft.add(tool, "time_range", times, source=analysis)
        draft.add(tool, "forces_to_exclude", "" if uses_forces else "Muscles", source=analysis)
        draft.add(
            tool,
            "output_gen_force_file",
            f"{tool.get('name', '')}_InverseDynamics.sto",
            source=analysis,
        )
        for other in elements(analyses):
            if other is not analysis:
                draft.changed(
                    tool,
                    at=other,
                    lost=f"the analysis {other.tag} beside it, which needs a tool of its own",
                )
        for analysis_set in tool.findall("AnalysisSet"):
            draft.remove(analysis_set)
        draft.rename(tool, "InverseDynamicsTool")
        draft.changed(tool)
