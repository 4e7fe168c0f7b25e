"""OSIM853: settings of the scale tool that have no effect, or make it fail."""

from __future__ import annotations

from typing import Any

from osimlite.lint.registry import ERROR, FindingCollector, rule
from osimlite.lint.setup import NO_FILE_CONSEQUENCE, Setup, names_file, select_members
from osimlite.lint.words import describe_object, find_nearest_name

_TOOL = """```setup
<ScaleTool name="scale">
  <mass>70</mass>
  <GenericModelMaker> <model_file>leg.osim</model_file> </GenericModelMaker>
  <ModelScaler>
    <scaling_order>measurements</scaling_order> <marker_file>leg.trc</marker_file>
    <MeasurementSet> <objects> <Measurement name="thigh">
      <MarkerPairSet> <objects>
        <MarkerPair> <markers>asis knee_marker</markers> </MarkerPair>
      </objects> </MarkerPairSet>
      <BodyScaleSet> <objects>
        <BodyScale name="thigh"> <axes>X Y</axes> </BodyScale>
      </objects> </BodyScaleSet>
    </Measurement> </objects> </MeasurementSet>
    <time_range>0 0.5</time_range> <output_model_file>scaled.osim</output_model_file>
  </ModelScaler>
  <MarkerPlacer>
    <marker_file>leg.trc</marker_file> <time_range>0 0.5</time_range> <output_model_file>placed.osim</output_model_file>
  </MarkerPlacer>
</ScaleTool>
```"""
_LINES = {"mass": 2, "scaler": 5, "pairs": 8, "axes": 11, "placer": 17}
"""Numbers of the lines of the tool that examples replace."""


def _make_frame(number: int) -> str:
    lines = _TOOL.split("\n")
    lines[number] = " " * (len(lines[number]) - len(lines[number].lstrip())) + "{}"
    return "\n".join(lines)


_FRAMES = {name: _make_frame(number) for name, number in _LINES.items()}


_FAULTS = """\
01 mass-not-scaled, warning, in mass: The target mass is not positive. OpenSim does not change the mass.
- <mass>0</mass>
+ <mass>70</mass>
02 model-not-scaled, warning, in scaler: The model scaler is disabled. The model is not scaled.
- <apply>false</apply>
  <scaling_order>measurements</scaling_order> <marker_file>leg.trc</marker_file>
03 unknown-scaling, error, fix unsafe, in scaler: The scaling order has an unknown word. OpenSim knows
measurements and manualScale, and rejects others.
- <scaling_order>measurement</scaling_order> <marker_file>leg.trc</marker_file>
+ <scaling_order>measurements</scaling_order> <marker_file>leg.trc</marker_file>
04 manual-scale-overwritten, warning, in scaler: Measurements come after manual scaling. They overwrite it.
- <scaling_order>manualScale measurements</scaling_order> <marker_file>leg.trc</marker_file>
+ <scaling_order>measurements manualScale</scaling_order> <marker_file>leg.trc</marker_file>
05 measured-without-markers, warning, in scaler: A scaler uses measurements without marker data. Nothing is measured.
- <scaling_order>measurements</scaling_order>
+ <scaling_order>measurements</scaling_order> <marker_file>leg.trc</marker_file>
06 measurement-without-pair, warning, in pairs: A measurement has no pair of markers. It measures nothing.
+ <MarkerPair> <markers>asis knee_marker</markers> </MarkerPair>
07 marker-pair-count, error, in pairs: A pair does not have two markers. OpenSim crashes.
- <MarkerPair> <markers>asis</markers> </MarkerPair>
+ <MarkerPair> <markers>asis knee_marker</markers> </MarkerPair>
08 marker-paired-with-itself, warning, in pairs: Both markers of a pair are the same. OpenSim ignores the measurement.
- <MarkerPair> <markers>asis asis</markers> </MarkerPair>
+ <MarkerPair> <markers>asis knee_marker</markers> </MarkerPair>
09 unknown-scale-axis, error, in axes: A body is scaled along an unknown axis. OpenSim ignores what is
not X, Y or Z, without a message, and the body keeps its size.
- <BodyScale name="thigh"> <axes>XY</axes> </BodyScale>
+ <BodyScale name="thigh"> <axes>X Y</axes> </BodyScale>
10 markers-not-placed, warning, in placer: The marker placer is disabled. The tool reports a failure.
- <apply>false</apply>
  <marker_file>leg.trc</marker_file> <time_range>0 0.5</time_range>
  <output_model_file>placed.osim</output_model_file>
11 placed-model-not-written, warning, in placer: The model with placed markers is not written. The result of the tool
is lost.
  <marker_file>leg.trc</marker_file> <time_range>0 0.5</time_range>
+ <output_model_file>placed.osim</output_model_file>
12 static-times, error, in placer: The time range of the static trial is empty, or the trial has a single
frame. OpenSim fails. Add a copy of the frame with a later time.
  <marker_file>leg.trc</marker_file> <output_model_file>placed.osim</output_model_file>
- <time_range>0.5 0.5</time_range>
+ <time_range>0 0.5</time_range>
"""


@rule("OSIM853", "scale-setting", severity=ERROR, about="document", faults=_FAULTS, frames=_FRAMES)
def report_scale_setting(setup: Setup, report: FindingCollector) -> None:
    """A setting of the scale tool has no effect, or makes it fail.

    Checks the mass, the order of scaling, measurements, axes, skipped steps, and averaged times.

    A measurement with one marker makes OpenSim crash. OpenSim ignores unknown words in `axes`
    without a message, and the body keeps its size.
    """
    for tool in setup.find_by_class("ScaleTool"):
        scaler = tool.model_scaler
        if tool.mass == 0.0 or (
            tool.mass < 0.0 and scaler.apply and scaler.preserve_mass_distribution
        ):
            report(
                f"the mass is {tool.mass:g}: OpenSim keeps the mass of the generic model; write that of "
                "the subject",
                tool,
                tag="mass",
                fault="mass-not-scaled",
            )
    for scaler in setup.find_by_class("ModelScaler"):
        if not scaler.apply:
            report("the model is not scaled", scaler, tag="apply", fault="model-not-scaled")
            continue
        for word in scaler.scaling_order:
            if word not in ("measurements", "manualScale"):
                report(
                    f"'{word}' is not a scaling method: OpenSim rejects it",
                    scaler,
                    tag="scaling_order",
                    word=word,
                    suggestion=find_nearest_name(word, ["measurements", "manualScale"]),
                    fault="unknown-scaling",
                )
        measures = "measurements" in scaler.scaling_order
        if scaler.scaling_order[:1] == ("manualScale",) and measures:
            report(
                "OpenSim applies the measurements last, so that they overwrite the manual scale factors; "
                "write 'measurements manualScale' if the manual factors should count",
                scaler,
                tag="scaling_order",
                fault="manual-scale-overwritten",
            )
        if measures and scaler.measurement_set.objects and not names_file(scaler.marker_file):
            report(
                f"{describe_object(scaler)} uses measurements, but names no marker_file: "
                f"{NO_FILE_CONSEQUENCE}",
                scaler,
                tag="marker_file",
                fault="measured-without-markers",
            )
    for measurement in setup.find_by_class("Measurement"):
        if not measurement.apply:
            continue
        pairs = select_members(measurement.marker_pair_set, "MarkerPair")
        if not pairs:
            report(
                f"{describe_object(measurement)} has no pair of markers: it measures nothing",
                measurement,
                fault="measurement-without-pair",
            )
        for pair in pairs:
            if len(pair.markers) != 2:
                report(
                    f"expected two markers in a pair, found {len(pair.markers)}: OpenSim crashes",
                    pair,
                    tag="markers",
                    fault="marker-pair-count",
                )
            elif pair.markers[0] == pair.markers[1]:
                report(
                    f"both markers of a pair are '{pair.markers[0]}': OpenSim ignores "
                    f"{describe_object(measurement)}",
                    pair,
                    tag="markers",
                    fault="marker-paired-with-itself",
                )
    for scale in setup.find_by_class("BodyScale"):
        for axis in scale.axes:
            # OpenSim compares whole words, in upper and in lower case.
            if axis.upper() not in ("X", "Y", "Z"):
                report(
                    f"expected an axis X, Y or Z, found '{axis}': OpenSim ignores it",
                    scale,
                    tag="axes",
                    word=axis,
                    fault="unknown-scale-axis",
                )
    for placer in setup.find_by_class("MarkerPlacer"):
        if not placer.apply:
            report(
                "MarkerPlacer is off: OpenSim's ScaleTool scales the model, but then reports a failure",
                placer,
                tag="apply",
                fault="markers-not-placed",
            )
        elif not names_file(placer.output_model_file):
            report(
                "the model with its markers placed is not written",
                placer,
                tag="output_model_file",
                fault="placed-model-not-written",
            )
        if placer.apply and placer.time_range and not placer.time_range[0] < placer.time_range[-1]:
            report(
                f"times from {placer.time_range[0]:g} to {placer.time_range[-1]:g} s cannot be "
                "averaged: OpenSim fails",
                placer,
                tag="time_range",
                fault="static-times",
            )
        elif placer.apply and len(placer.time_range) == 2 and names_file(placer.marker_file):
            _check_static_times(setup, placer, report)


def _check_static_times(setup: Setup, placer: Any, report: FindingCollector) -> None:
    """Report a static trial with one frame or none within the time range of the marker placer."""
    table = setup.read_table(placer.marker_file)
    if table is None or table.span is None or not table.is_markers:
        return
    first, last = max(placer.time_range[0], table.span[0]), min(placer.time_range[1], table.span[1])
    if first < last:
        return
    if table.span[0] == table.span[1]:
        report(
            f"'{placer.marker_file}' has one frame, at {table.span[0]:g} s, but OpenSim averages "
            "over a range of times and fails; add a copy of the row with a later time",
            placer,
            tag="marker_file",
            fault="static-times",
        )
    else:
        report(
            f"'{placer.marker_file}' covers {table.span[0]:g} to {table.span[1]:g} s, and fewer "
            "than two frames are in the time range of the tool: OpenSim fails",
            placer,
            tag="time_range",
            fault="static-times",
        )
