"""OSIM901 to OSIM907: markers, motions and measured loads of a finished trial."""

from __future__ import annotations

from osimlite.lint.registry import WARNING, FindingSink, Threshold, rule
from osimlite.lint.trial import CHECKLIST, HICKS, OPENSIM, OURS, TRIAL, Trial

SCALE_RMS = Threshold(
    "scale-marker-rms", 1.0, "cm", "root mean square of the marker errors of a scaled model"
)
SCALE_PEAK = Threshold("scale-marker-peak", 2.0, "cm", "largest of them")
RMS = Threshold(
    "marker-rms", 2.0, "cm", "root mean square of the marker errors of inverse kinematics"
)
PEAK = Threshold("marker-peak", 4.0, "cm", "largest of them")
SWAPPED = Threshold(
    "swapped-frames", 2.0, "%", "frames in which two markers would fit better exchanged"
)
BEYOND = Threshold(
    "beyond-range",
    2.0,
    "deg",
    "so far (cm for translations) a motion may leave the range of a coordinate",
)
FAR_BEYOND = Threshold("far-beyond-range", 10.0, "deg", "from here on that is bad")
LOST = Threshold(
    "filtered-away",
    2.0,
    "deg",
    "root mean square (cm for translations) of what a filter takes away",
)
NOISE = Threshold("noise", 50.0, "%", "of the power of an acceleration that may lie above 15 Hz")
SWAPPED_FEET = Threshold(
    "swapped-feet", 25.0, "%", "of the time that a load may act nearer to another foot"
)
WEIGHT = Threshold(
    "measured-weight", 2.0, "%", "by which the mass of a model may differ from what plates carry"
)
WRONG_WEIGHT = Threshold("wrong-weight", 5.0, "%", "from here on that is bad")


@rule(
    "OSIM901",
    "scale-marker-error",
    severity=WARNING,
    thresholds=(SCALE_RMS, SCALE_PEAK),
    about=TRIAL,
)
def scale_marker_error(trial: Trial, report: FindingSink) -> None:
    """A scaled model does not fit the static trial.

    Does what the setup of the ScaleTool says, and compares the markers that pose the scaled model,
    before they are moved, with where they were measured: 1 cm for the root mean square, and 2 cm
    for the largest error of markers on bones. The limits are those of OpenSim's checklist for
    evaluating a simulation
    (https://simtk-confluence.stanford.edu:8443/plugins/viewsource/viewpagesrc.action?pageId=3376337).

    Everything that follows is computed with these lengths of segments: joints lie elsewhere than
    those of the subject, and so do moment arms.

    ```trial
    - peak of marker errors: 3.1 cm
    + peak of marker errors: 1.4 cm
    ```
    """
    advice = "look at the markers on bones, the pairs that measure their segment, and the pose of the static trial"
    trial.judge(report, [SCALE_RMS], CHECKLIST, advice, "rms")
    trial.judge(report, [SCALE_PEAK], CHECKLIST, advice, "peak")


@rule("OSIM902", "marker-error", severity=WARNING, thresholds=(RMS, PEAK), about=TRIAL)
def marker_error(trial: Trial, report: FindingSink) -> None:
    """A motion does not fit the measured markers.

    Puts the model into the poses of a motion that an InverseKinematicsTool has made, and compares
    the markers that it was to fit with where they were measured: less than 2 cm for the root mean
    square over all frames, and less than 4 cm for the largest error. The limits are those of
    OpenSim's best practices
    (https://opensimconfluence.atlassian.net/wiki/spaces/OpenSim/pages/53087686). Without the model
    or the markers it takes the file of errors that the tool writes.

    Angles are wrong by what the markers are off. One bad marker bends the segments beside its own,
    too.

    ```trial
    - peak of marker errors: 6.2 cm
    + peak of marker errors: 2.8 cm
    ```
    """
    advice = "look where this marker is on the model, whether it was taken for another, and what it weighs"
    trial.judge(report, [RMS], OPENSIM, advice, "rms")
    trial.judge(report, [PEAK], OPENSIM, advice, "peak")


@rule("OSIM903", "swapped-markers", severity=WARNING, thresholds=(SWAPPED,), about=TRIAL)
def swapped_markers(trial: Trial, report: FindingSink) -> None:
    """Two markers were taken for each other.

    Where a marker is more than 4 cm off, it exchanges every two markers of the frame that fits
    worst, and fits a pose to what comes out. A pair that leaves less than half of the squares of
    the errors was probably taken for each other; it is then exchanged in 24 frames from first to
    last, and the rule says in how many that helps.

    Inverse kinematics goes half of the way to both wrong places, and turns the segment; where left
    and right were exchanged it turns the whole body, and other markers seem to be wrong.

    ```trial
    - share of frames in which R.Knee and R.Ankle would fit exchanged: 38 %
    + share of frames in which R.Knee and R.Ankle would fit exchanged: 0 %
    ```
    """
    trial.judge(
        report,
        [SWAPPED],
        OURS,
        "exchange their names in the file of markers, from where to where it says",
        "share",
    )


@rule("OSIM904", "beyond-range", severity=WARNING, thresholds=(BEYOND, FAR_BEYOND), about=TRIAL)
def beyond_range(trial: Trial, report: FindingSink) -> None:
    """A motion leaves the range of a coordinate.

    Compares the motions of inverse kinematics, RRA and CMC with the `range` of each coordinate of
    the model, clamped or not. OpenSim keeps to the range only where `clamped` says so, and only in
    inverse kinematics.

    Splines and curves of muscles are made for the range: outside it, moment arms and passive forces
    are nobody's. A joint that seems to go there often has its axis, or its markers, in the wrong
    place.

    ```trial
    - peak of 'knee_angle_r' beyond its range: 14 deg
    + peak of 'knee_angle_r' beyond its range: 1 deg
    ```
    """
    trial.judge(
        report,
        [BEYOND, FAR_BEYOND],
        OURS,
        "widen the range if the joint goes there, else look at the markers",
        "peak",
    )


@rule("OSIM905", "filter-content", severity=WARNING, thresholds=(LOST, NOISE), about=TRIAL)
def filter_content(trial: Trial, report: FindingSink) -> None:
    """A filter takes motion away, or leaves noise.

    Runs the motion that a tool is given through the filter that its setup asks for. Looks by how
    much it changes any
    coordinate: 2 degrees or 2 cm (root mean square) are what OpenSim's best practices call good for
    a motion that is tracked
    (https://opensimconfluence.atlassian.net/wiki/spaces/OpenSim/pages/53087686). Of a motion that
    comes from markers it also looks at what is left: of the power of the accelerations, at most
    half may lie above 15 Hz, as what people do on foot is slower (Winter 2009, Biomechanics and
    Motor Control of Human Movement, chapter 3).

    Forces follow accelerations, which noise of a tenth of a degree makes useless. A filter that is
    too strong takes the motion itself away, above all where feet strike.

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
        OURS,
        "take a lowpass_cutoff_frequency that leaves the motion; 6 Hz are usual for walking",
        "noise",
    )


@rule("OSIM906", "swapped-feet", severity=WARNING, thresholds=(SWAPPED_FEET,), about=TRIAL)
def swapped_feet(trial: Trial, report: FindingSink) -> None:
    """A force plate was taken for that of the other foot.

    Puts the model into poses of its motion in which a measured force is large, and looks whether it
    acts nearer to another body that loads are applied to, or to that of the other side, than to its
    own.

    All moments of both legs are wrong by the force times the length of a step, and the residuals
    show it.

    ```trial
    - share of the time that the force 'right' acts nearer to calcn_l than to calcn_r: 100 %
    + share of the time that the force 'right' acts nearer to calcn_l than to calcn_r: 0 %
    ```
    """
    trial.judge(
        report, [SWAPPED_FEET], OURS, "exchange the bodies (applied_to_body) or the plates", "share"
    )


@rule(
    "OSIM907", "measured-weight", severity=WARNING, thresholds=(WEIGHT, WRONG_WEIGHT), about=TRIAL
)
def measured_weight(trial: Trial, report: FindingSink) -> None:
    """The model weighs something else than what the force plates carry.

    Compares the mass of the model with the mean vertical force of all loads, divided by gravity and
    the mean vertical acceleration of the mass centre, while at least one foot stands on a plate.
    What differs by more than 5 % of the weight is more than the residual force that Hicks and
    others advise at most (2015, Is my model good enough?, https://doi.org/10.1115/1.4029304).

    A residual force makes up for it all the time, and the moments of the legs are those of another
    person. A plate that is not in the file, or is calibrated wrongly, shows in the same way.

    ```trial
    - difference of the mass of the model from 72.1 kg on the plates: 12 %
    + difference of the mass of the model from 72.1 kg on the plates: 0.7 %
    ```
    """
    trial.judge(
        report,
        [WEIGHT, WRONG_WEIGHT],
        HICKS,
        "give the mass of the subject to the ScaleTool, and look whether all plates are in the loads",
        "difference",
    )
