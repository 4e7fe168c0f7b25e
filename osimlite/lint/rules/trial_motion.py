"""OSIM901 to OSIM907: markers, motions and measured loads of a finished trial."""

from __future__ import annotations

from osimlite.lint.registry import WARNING, FindingCollector, Threshold, rule
from osimlite.lint.trial import CHECKLIST, HICKS, OPENSIM, OSIMLITE, TRIAL, Trial

SCALE_RMS = Threshold(
    "scale-marker-rms",
    1.0,
    "cm",
    "largest accepted root mean square of the marker errors of a scaled model",
)
SCALE_PEAK = Threshold(
    "scale-marker-peak",
    2.0,
    "cm",
    "largest accepted marker error of a scaled model",
)
RMS = Threshold(
    "marker-rms",
    2.0,
    "cm",
    "largest accepted root mean square of the marker errors of inverse kinematics",
)
PEAK = Threshold(
    "marker-peak",
    4.0,
    "cm",
    "largest accepted marker error of inverse kinematics",
)
SWAPPED = Threshold(
    "swapped-frames",
    2.0,
    "%",
    "largest accepted share of the frames in which two markers fit better if they are swapped",
)
BEYOND = Threshold(
    "beyond-range",
    2.0,
    "deg",
    "largest accepted distance of a motion outside the range of a coordinate (cm for translations)",
)
FAR_BEYOND = Threshold(
    "far-beyond-range",
    10.0,
    "deg",
    "a distance outside the range above this is bad (cm for translations)",
)
LOST = Threshold(
    "filtered-away",
    2.0,
    "deg",
    "largest accepted change of a motion by a filter, as root mean square (cm for translations)",
)
NOISE = Threshold(
    "noise",
    50.0,
    "%",
    "largest accepted share of the power of an acceleration above 15 Hz",
)
SWAPPED_FEET = Threshold(
    "swapped-feet",
    25.0,
    "%",
    "largest accepted share of the time in which a load acts nearer to another foot",
)
WEIGHT = Threshold(
    "measured-weight",
    2.0,
    "%",
    "largest accepted difference between the mass of the model and the mass on the force plates",
)
WRONG_WEIGHT = Threshold(
    "wrong-weight",
    5.0,
    "%",
    "a difference of the mass above this is bad",
)


@rule(
    "OSIM901",
    "scale-marker-error",
    severity=WARNING,
    thresholds=(SCALE_RMS, SCALE_PEAK),
    about=TRIAL,
)
def report_scale_marker_error(trial: Trial, report: FindingCollector) -> None:
    """A scaled model does not fit the static trial.

    Runs the setup of the ScaleTool up to the step that poses the scaled model as in the static
    trial. Compares the markers of the model with the measured ones; the tool has not yet moved
    them. Only markers with more than a tenth of the largest weight count. Accepts 1 cm for the root
    mean square, and 2 cm for the largest error of markers on bones. The limits are those of
    OpenSim's checklist for evaluating a simulation
    (https://simtk-confluence.stanford.edu:8443/plugins/viewsource/viewpagesrc.action?pageId=3376337).

    All later results are computed with the segment lengths of this model: its joint positions and
    moment arms differ from those of the subject.

    ```trial
    - peak of marker errors: 3.1 cm
    + peak of marker errors: 1.4 cm
    ```
    """
    # The limits and their sources are OpenSim's own documents, so that users can look them up.
    advice = (
        "check the positions of markers on bones, the marker pairs that scale the segment, and the pose of the "
        "static trial"
    )
    trial.judge(report, [SCALE_RMS], CHECKLIST, advice, "rms")
    trial.judge(report, [SCALE_PEAK], CHECKLIST, advice, "peak")


@rule("OSIM902", "marker-error", severity=WARNING, thresholds=(RMS, PEAK), about=TRIAL)
def report_marker_error(trial: Trial, report: FindingCollector) -> None:
    """A motion does not fit the measured markers.

    Poses the model along the motion of an InverseKinematicsTool, and compares the fitted markers
    with the measured ones. Accepts 2 cm for the root mean square over all frames, and 4 cm for the
    largest error. The limits are those of OpenSim's best practices
    (https://opensimconfluence.atlassian.net/wiki/spaces/OpenSim/pages/53087686). If the model or
    the markers are missing, the rule uses the file of errors that the tool writes.

    Marker errors make angles wrong. One bad marker also affects the neighbouring segments.

    ```trial
    - peak of marker errors: 6.2 cm
    + peak of marker errors: 2.8 cm
    ```
    """
    advice = (
        "check the positions of the markers on the model, their weights, and whether two of them are "
        "swapped"
    )
    trial.judge(report, [RMS], OPENSIM, advice, "rms")
    trial.judge(report, [PEAK], OPENSIM, advice, "peak")


@rule("OSIM903", "swapped-markers", severity=WARNING, thresholds=(SWAPPED,), about=TRIAL)
def report_swapped_markers(trial: Trial, report: FindingCollector) -> None:
    """Two markers are swapped.

    Checks motions with a marker error of more than 4 cm. In the worst frame, the rule swaps each
    pair of markers and fits the pose again. If a swap halves the sum of squared errors, the pair is
    probably swapped. The rule then swaps this pair in 24 frames from the first to the last, and
    reports in how many of them the fit improves.

    Inverse kinematics compromises between both wrong positions, and rotates the segment. If left
    and right are swapped, it rotates the whole body, and other markers seem to be wrong.

    ```trial
    - share of frames in which R.Knee and R.Ankle would fit exchanged: 38 %
    + share of frames in which R.Knee and R.Ankle would fit exchanged: 0 %
    ```
    """
    trial.judge(
        report,
        [SWAPPED],
        OSIMLITE,
        "exchange their names in the marker file, at these times",
        "share",
    )


@rule("OSIM904", "beyond-range", severity=WARNING, thresholds=(BEYOND, FAR_BEYOND), about=TRIAL)
def report_beyond_range(trial: Trial, report: FindingCollector) -> None:
    """A motion leaves the range of a coordinate.

    Compares the motions of inverse kinematics, RRA and CMC with the `range` of each coordinate of
    the model, clamped or not. OpenSim enforces the range only for `clamped` coordinates, and only
    in inverse kinematics.

    Splines and muscle curves are made for the range: outside it, moment arms and passive forces are
    meaningless. Often the axis or the markers of the joint are in the wrong place.

    ```trial
    - peak of 'knee_angle_r' beyond its range: 14 deg
    + peak of 'knee_angle_r' beyond its range: 1 deg
    ```
    """
    trial.judge(
        report,
        [BEYOND, FAR_BEYOND],
        OSIMLITE,
        "widen the range if the joint really moves so far, otherwise check the markers",
        "peak",
    )


@rule("OSIM905", "filter-content", severity=WARNING, thresholds=(LOST, NOISE), about=TRIAL)
def report_filter_content(trial: Trial, report: FindingCollector) -> None:
    """A filter removes motion, or leaves noise.

    Applies the filter of the setup to the motion of a tool, and checks how much each coordinate
    changes. The limit is 2 degrees or 2 cm (root mean square), which OpenSim's best practices call
    good for a tracked motion
    (https://opensimconfluence.atlassian.net/wiki/spaces/OpenSim/pages/53087686). For a motion from
    markers the rule also checks the noise: at most half of the power of the accelerations may lie
    above 15 Hz. Human gait is slower (Winter 2009, Biomechanics and Motor Control of Human
    Movement, chapter 3).

    Forces are computed from accelerations, and noise of a tenth of a degree is enough to make
    accelerations useless. A filter that is too strong removes the motion itself, above all at foot
    strike.

    ```trial
    - change of 'knee_angle_r' by a filter of 1 Hz: 9.1 deg
    + change of 'knee_angle_r' by a filter of 6 Hz: 0.2 deg
    ```
    """
    trial.judge(
        report,
        [LOST],
        OPENSIM,
        "take a higher lowpass_cutoff_frequency; 6 Hz are usual for walking",
        "change",
    )
    trial.judge(
        report,
        [NOISE],
        OSIMLITE,
        "choose a lowpass_cutoff_frequency that removes noise and keeps the motion; 6 Hz are usual for walking",
        "noise",
    )


@rule("OSIM906", "swapped-feet", severity=WARNING, thresholds=(SWAPPED_FEET,), about=TRIAL)
def report_swapped_feet(trial: Trial, report: FindingCollector) -> None:
    """A force plate is assigned to the wrong foot.

    Checks the times at which a measured force is large, with the model in its pose at each time.
    Reports a force that acts nearer to another loaded body, or to the body of the other side, than
    to the body to which the setup applies it.

    All moments of both legs are wrong by the force times the step width or length. The residuals do
    not show this error, because they depend on the sum of the loads.

    ```trial
    - share of the time that the force 'right' acts nearer to calcn_l than to calcn_r: 100 %
    + share of the time that the force 'right' acts nearer to calcn_l than to calcn_r: 0 %
    ```
    """
    trial.judge(
        report,
        [SWAPPED_FEET],
        OSIMLITE,
        "exchange the bodies (applied_to_body) or the plates",
        "share",
    )


@rule(
    "OSIM907", "measured-weight", severity=WARNING, thresholds=(WEIGHT, WRONG_WEIGHT), about=TRIAL
)
def report_measured_weight(trial: Trial, report: FindingCollector) -> None:
    """The mass of the model differs from the measured weight.

    Compares the mass of the model with the measured mass. This is the mean vertical force of all
    loads, divided by the sum of gravity and the mean vertical acceleration of the mass centre. The
    means run from the first to the last time at which a foot stands on a plate. A difference of
    more than 5 % of the weight exceeds the largest residual force that Hicks and others recommend
    (2015, Is my model good enough?, https://doi.org/10.1115/1.4029304).

    All the time, a residual force makes up for the difference, and the leg moments belong to
    another person. A missing plate, or a wrong calibration, has the same effect.

    ```trial
    - difference between the model's mass, 80.8 kg, and 72.1 kg on the plates: 12 %
    + difference between the model's mass, 72.6 kg, and 72.1 kg on the plates: 0.7 %
    ```
    """
    trial.judge(
        report,
        [WEIGHT, WRONG_WEIGHT],
        HICKS,
        "give the mass of the subject to the ScaleTool, and check whether all plates are in the "
        "loads",
        "difference",
    )
