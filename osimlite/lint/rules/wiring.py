"""OSIM33x: connections by position or output: controllers and actuators, inputs and outputs."""

from __future__ import annotations

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later
from osimlite.base.text import add_article, find_nearest, format_count
from osimlite.lint.fixes import replace_text
from osimlite.lint.registry import ERROR, REFUSES, FindingCollector, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object
from osimlite.schema.base import Component, Unknown
from osimlite.schema.frames import Frame
from osimlite.schema.geometry import Geometry
from osimlite.schema.resolution import normalize_path
from osimlite.schema.states import list_outputs
from osimlite.schema.tree import Use


@rule("OSIM331", "control-function-count", severity=ERROR, consequences=(REFUSES,))
def report_control_function_count(subject: Subject, report: FindingCollector) -> None:
    """A prescribed controller has a different number of functions and actuators.

    Compares the number of control functions with the number of actuators. Controllers that read
    their controls from a file are not checked.

    The first function drives the first actuator, and so on; names do not matter. OpenSim rejects
    the model if the numbers differ.

    ```xml
      <CoordinateActuator name="motor"> <coordinate>knee_angle</coordinate> </CoordinateActuator>
      <PrescribedController name="drive">
          <socket_actuators>/forceset/motor</socket_actuators>
    -     <FunctionSet name="ControlFunctions"> <objects /> </FunctionSet>
    +     <FunctionSet name="ControlFunctions">
    +         <objects> <Constant name="motor"> <value>0.1</value> </Constant> </objects>
    +     </FunctionSet>
      </PrescribedController>
    ```
    """
    for controller in subject.find_by_class("PrescribedController"):
        if isinstance(controller.ControlFunctions, Unknown):
            continue
        functions = len(controller.ControlFunctions.objects)
        actuators = len(controller.socket_actuators)
        if subject.version is not None and subject.version < 40600:
            # There OpenSim drops a name that no actuator has.
            actuators = sum(
                1
                for use in subject.uses
                if use.holder is controller and subject.resolution(use).target is not None
            )
        if controller.controls_file is None and functions != actuators:
            report(
                f"{describe_object(controller)} has {format_count(functions, 'control function')} for "
                f"{format_count(actuators, 'actuator')}: OpenSim rejects the model",
                controller.ControlFunctions if functions else controller,
            )


@rule("OSIM332", "broken-input", severity=ERROR, fixes="unsafe", consequences=(REFUSES,))
def report_broken_input(subject: Subject, report: FindingCollector) -> None:
    """An input refers to an output that does not exist.

    Checks the inputs of reporters, controllers and geometry. An input must consist of the path of a
    component, a bar (|), and an output of this component. The output must have the type that the
    input takes.

    OpenSim rejects the model when it connects the components. Paths are absolute, or relative to
    the component with the input. OpenSim also rejects any input of a geometry that a frame draws.

    ```xml
      <components>
          <TableReporter__double_ name="table">
    -         <input_inputs>/jointset/knee/knee_angle|velocity</input_inputs>
    +         <input_inputs>/jointset/knee/knee_angle|speed</input_inputs>
          </TableReporter__double_>
      </components>
    ```
    """
    for use in subject.uses:
        if use.reference.rule != "input" or not isinstance(use.value, str) or not use.value:
            continue
        fault = _describe_input_fault(subject, use, use.value)
        if fault is None:
            continue
        value = getattr(use.holder, use.spec.name)
        nth = value[: use.position].count(use.value) if isinstance(value, tuple) else 0
        position = subject.position(use.holder, tag=use.spec.tag, word=use.value, nth=nth)
        report(
            f"{describe_object(use.holder)}: <{use.spec.tag}> names '{use.value}'{fault.message}",
            use.holder,
            at=position,
            suggestion=fault.suggestion,
            fix=replace_text(subject.source, position, fault.suggestion, safe=False),
        )


@rule("OSIM333", "connected-twice", severity=ERROR, consequences=(REFUSES,))
def report_connected_twice(subject: Subject, report: FindingCollector) -> None:
    """A list of sockets names the same component twice.

    Reports every mention of an actuator after the first in the list of one controller.

    OpenSim rejects the model when it connects the components.

    ```xml
      <CoordinateActuator name="motor"> <coordinate>knee_angle</coordinate> </CoordinateActuator>
      <PrescribedController name="drive">
    -     <socket_actuators>/forceset/motor /forceset/motor</socket_actuators>
    -     <FunctionSet name="ControlFunctions">
    -         <objects> <Constant name="a" /> <Constant name="b" /> </objects>
    -     </FunctionSet>
    +     <socket_actuators>/forceset/motor</socket_actuators>
    +     <FunctionSet name="ControlFunctions"> <objects> <Constant name="a" /> </objects> </FunctionSet>
      </PrescribedController>
    ```
    """
    targets_by_list: dict[tuple[int, str], list[tuple[Component, str]]] = {}
    for use in subject.uses:
        if use.reference.rule != "socket" or use.position is None:
            continue
        target = subject.resolution(use).target
        if target is None:
            continue
        text = use.text
        list_targets = targets_by_list.setdefault((id(use.holder), use.spec.tag), [])
        # By identity: two different texts can name the same component.
        if any(target_before is target for target_before, _ in list_targets):
            report(
                f"{describe_object(use.holder)} lists {describe_object(target)} again: OpenSim "
                "rejects the model",
                use.holder,
                tag=use.spec.tag,
                word=text,
                nth=sum(1 for _, word in list_targets if word == text),
            )
        list_targets.append((target, text))


class _InputFault(NamedTuple):
    """Fault in the text of an input, with a correct text."""

    message: str
    suggestion: str | None = None


# The path of a component, a bar, an output, a channel of it and another name for it; the last two
# may be left out.
_INPUT = compile_later(
    r"(?:(?P<path>.*)\|)?(?P<output>[^|:(]*)(?::(?P<channel>[^(]*))?(?:\((?P<alias>.*)\))?"
)


def _describe_input_fault(subject: Subject, use: Use, text: str) -> _InputFault | None:
    """Return why an input does not connect to an output; None if it connects."""
    match = _INPUT.fullmatch(text)
    if match is None or match["path"] is None:
        return _InputFault("; expected the path of a component, a bar and an output")
    tree = subject.tree
    path = match["path"]
    base = tree.path_of(use.owner) or "/"
    component_path = normalize_path(path if path.startswith("/") else f"{base}/{path}")
    component = tree.by_path.get(component_path) if component_path is not None else None
    if component is None:
        # An object of a class that osimlite does not know may contain the component.
        if subject.has_unknown:
            return None
        nearest = find_nearest(
            path,
            [
                known_output
                for known_output, item in tree.by_path.items()
                if list_outputs(type(item))
            ],
        )
        return _InputFault(
            f", but there is no component '{path}'",
            text.replace(path, nearest, 1) if nearest else None,
        )
    if isinstance(component, Unknown):
        return None
    outputs = list_outputs(type(component))
    kind = use.reference.target
    known_output = outputs.get(match["output"])
    if known_output is None:
        nearest = find_nearest(
            match["output"], [name for name, output in outputs.items() if output.type == kind]
        )
        suggestion = None if nearest is None else f"{path}|{nearest}" + text[match.end("output") :]
        return _InputFault(
            f", but {describe_object(component)} has no output '{match['output']}'", suggestion
        )
    if known_output.type != kind:
        return _InputFault(
            f", which is {_describe_type(known_output.type)}, not {_describe_type(kind)}"
        )
    if match["channel"] and not known_output.channels:
        return _InputFault(f", but that output has no channel '{match['channel']}'")
    parent = tree.parent_of(use.owner)
    if isinstance(use.owner, Geometry) and isinstance(parent, Frame):
        is_drawn = any(item is use.owner for item in parent.subcomponents)
        return (
            None
            if is_drawn
            else _InputFault(
                f"; {describe_object(parent)} draws it and moves it already: OpenSim rejects the "
                "model"
            )
        )
    return None


def _describe_type(kind: str) -> str:
    return "a number" if kind == "double" else add_article(kind)
