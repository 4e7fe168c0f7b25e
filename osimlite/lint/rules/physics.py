"""OSIM505 and on: gravity, materials, limits, ranges and units."""

from __future__ import annotations

import math

from osimlite.document.lexical import shortest
from osimlite.lint.engine import ERROR, INFO, WARNING, Found, rule
from osimlite.lint.fixes import replaced
from osimlite.lint.subject import Subject
from osimlite.lint.words import called, quantity
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.forces import CoordinateLimitForce, HuntCrossleyContactParameters, HuntCrossleyForce
from osimlite.schema.joints import Joint
from osimlite.schema.tree import Use


@rule("OSIM505", "strange-gravity", severity=WARNING)
def strange_gravity(subject: Subject, found: Found) -> None:
    """Gravity is far from that of the Earth.

    ## What it does
    Reports gravity stronger than 30 m/s^2, which is usually one in millimetres, and gravity that points up along Y.

    ## Why is this bad
    OpenSim works in metres, kilograms and seconds, with Y up. Lengths in millimetres make a model that falls a thousand
    times too fast.

    ## Example
    ```xml
    <gravity>0 -9806.65 0</gravity>
    ```

    ## Use instead
    ```xml
    <gravity>0 -9.80665 0</gravity>
    ```
    """
    model = subject.model
    assert model is not None
    size = math.sqrt(sum(part * part for part in model.gravity))
    if not math.isfinite(size):
        return
    if size > 30:
        unit = "; in millimetres?" if 9000 < size < 11000 else ""
        found(f"gravity is {quantity(size, 'm/s^2')}{unit}", model, tag="gravity")
    elif model.gravity[1] > 1e-9 * size and model.gravity[1] > 0.9 * size:
        found("gravity points up: Y is the upward axis in OpenSim", model, tag="gravity")


@rule("OSIM506", "friction-order", severity=WARNING)
def friction_order(subject: Subject, found: Found) -> None:
    """Static friction is smaller than dynamic friction.

    ## What it does
    Reports contact materials whose static coefficient is below the dynamic one.

    ## Why is this bad
    No material resists sliding more than sticking; usually the two numbers are swapped. Simbody's friction rises with
    the speed v of sliding, measured in transition velocities, as min(v, 1) (d + 2 (s - d) / (1 + v^2)), with s static
    and d dynamic: where s is less than half of d this is negative at small v, and friction pushes the way things slide.

    ## Example
    ```xml
    <HuntCrossleyForce name="foot_ground">
        <HuntCrossleyForce::ContactParametersSet name="contact_parameters">
            <objects>
                <HuntCrossleyForce::ContactParameters>
                    <geometry>heel floor</geometry> <stiffness>1e6</stiffness>
                    <static_friction>0.4</static_friction> <dynamic_friction>0.8</dynamic_friction>
                </HuntCrossleyForce::ContactParameters>
            </objects>
        </HuntCrossleyForce::ContactParametersSet>
    </HuntCrossleyForce>
    ```

    ## Use instead
    ```xml
    <HuntCrossleyForce name="foot_ground">
        <HuntCrossleyForce::ContactParametersSet name="contact_parameters">
            <objects>
                <HuntCrossleyForce::ContactParameters>
                    <geometry>heel floor</geometry> <stiffness>1e6</stiffness>
                    <static_friction>0.8</static_friction> <dynamic_friction>0.4</dynamic_friction>
                </HuntCrossleyForce::ContactParameters>
            </objects>
        </HuntCrossleyForce::ContactParametersSet>
    </HuntCrossleyForce>
    ```
    """
    for material in subject.each(HuntCrossleyContactParameters):
        if 0 <= material.static_friction < material.dynamic_friction:
            found(
                f"static friction of {subject.called(material)}, {quantity(material.static_friction)}, is smaller than "
                f"dynamic friction, {quantity(material.dynamic_friction)}"
                + (
                    "; less than half of it, so that friction drives slow sliding on"
                    if _drives(subject, material)
                    else ""
                ),
                material,
                tag="static_friction",
            )


@rule("OSIM507", "limits-swapped", severity=WARNING)
def limits_swapped(subject: Subject, found: Found) -> None:
    """The upper limit of a limit force lies below its lower limit.

    ## What it does
    Reports limit forces whose upper limit is smaller than the lower one.

    ## Why is this bad
    Between the two both springs push against each other, at every pose of the joint that was meant to be free.

    ## Example
    ```xml
    <CoordinateLimitForce name="stop">
        <coordinate>hip_flexion</coordinate> <upper_limit>-30</upper_limit> <lower_limit>90</lower_limit>
    </CoordinateLimitForce>
    ```

    ## Use instead
    ```xml
    <CoordinateLimitForce name="stop">
        <coordinate>hip_flexion</coordinate> <upper_limit>90</upper_limit> <lower_limit>-25</lower_limit>
    </CoordinateLimitForce>
    ```
    """
    for force in subject.each(CoordinateLimitForce):
        if force.upper_limit < force.lower_limit:
            found(
                f"the upper limit of {called(force)}, {quantity(force.upper_limit)}, is below the lower limit, "
                f"{quantity(force.lower_limit)}: both act at once",
                force,
                tag="upper_limit",
            )


@rule("OSIM508", "limit-outside-range", severity=INFO)
def limit_outside_range(subject: Subject, found: Found) -> None:
    """A limit force begins beyond the range of its coordinate.

    ## What it does
    Reports limits that lie outside the range of the coordinate by more than the transition.

    ## Why is this bad
    The range does not stop the motion, the limit force does; the model then moves further than its range says. Note
    that limits are in degrees and ranges in radians.

    ## Example
    ```xml
    <CoordinateLimitForce name="stop">
        <coordinate>knee_angle</coordinate> <upper_limit>0</upper_limit> <lower_limit>-170</lower_limit>
    </CoordinateLimitForce>
    ```

    ## Use instead
    ```xml
    <CoordinateLimitForce name="stop">
        <coordinate>knee_angle</coordinate> <upper_limit>0</upper_limit> <lower_limit>-120</lower_limit>
    </CoordinateLimitForce>
    ```
    """
    for force in subject.each(CoordinateLimitForce):
        coordinate, motion = _limited(subject, force)
        if coordinate is None or motion is None or "range" not in coordinate.model_fields_set:
            continue
        scale, unit = (180 / math.pi, "deg") if motion == "rotational" else (1.0, "m")
        low, high = sorted(bound * scale for bound in coordinate.range)
        slack = abs(force.transition) + 1e-6
        for tag, limit, outside in (
            ("upper_limit", force.upper_limit, force.upper_limit > high + slack),
            ("lower_limit", force.lower_limit, force.lower_limit < low - slack),
        ):
            if outside:
                found(
                    f"{tag} of {called(force)} is {quantity(limit, unit)}, beyond the range of '{coordinate.name}' "
                    f"({quantity(low)} to {quantity(high, unit)})",
                    force,
                    tag=tag,
                )


@rule("OSIM509", "limit-inside-range", severity=INFO)
def limit_inside_range(subject: Subject, found: Found) -> None:
    """A limit force begins well inside the range of its coordinate.

    ## What it does
    Reports limits inside the range of the coordinate by more than the transition and a quarter of the range. It is a
    warning if the default value of the coordinate is already beyond the limit.

    ## Why is this bad
    Part of the range can only be reached against the spring. Past the limit in the default pose, the force is there
    from the first instant. Note that limits are in degrees and ranges in radians.

    ## Example
    ```xml
    <CoordinateLimitForce name="stop">
        <coordinate>knee_angle</coordinate> <upper_limit>0</upper_limit> <lower_limit>-2.1</lower_limit>
    </CoordinateLimitForce>
    ```

    ## Use instead
    ```xml
    <CoordinateLimitForce name="stop">
        <coordinate>knee_angle</coordinate> <upper_limit>0</upper_limit> <lower_limit>-120</lower_limit>
    </CoordinateLimitForce>
    ```
    """
    for force in subject.each(CoordinateLimitForce):
        coordinate, motion = _limited(subject, force)
        if coordinate is None or motion is None or "range" not in coordinate.model_fields_set:
            continue
        scale, unit = (180 / math.pi, "deg") if motion == "rotational" else (1.0, "m")
        low, high = sorted(bound * scale for bound in coordinate.range)
        slack = max(abs(force.transition), 0.25 * (high - low)) + 1e-6
        start = coordinate.default_value * scale
        for tag, limit, inside, beyond in (
            ("upper_limit", force.upper_limit, low <= force.upper_limit < high - slack, start - force.upper_limit),
            ("lower_limit", force.lower_limit, high >= force.lower_limit > low + slack, force.lower_limit - start),
        ):
            acts = beyond > abs(force.transition)
            # A range of many turns stands for none, or is in degrees; so does a limit that is not given.
            given = tag in force.model_fields_set and (motion != "rotational" or high - low < 720)
            if inside and given and force.lower_limit <= force.upper_limit:
                found(
                    f"{tag} of {called(force)} is {quantity(limit, unit)}, inside the range of '{coordinate.name}' "
                    f"({quantity(low)} to {quantity(high, unit)})"
                    + (f"; it acts in the default pose, {quantity(start, unit)}" if acts else ""),
                    force,
                    tag=tag,
                    severity=WARNING if acts else None,
                )


@rule("OSIM511", "inverted-range", severity=WARNING)
def inverted_range(subject: Subject, found: Found) -> None:
    """The range of a coordinate ends before it begins.

    ## What it does
    Reports ranges whose first number is larger than the second; an error if the coordinate is clamped.

    ## Why is this bad
    OpenSim refuses to load a clamped coordinate like this. Otherwise it does not check, and sliders and solvers that
    use the range misbehave.

    ## Example
    ```xml
    <PinJoint name="knee">
        <socket_parent_frame>/bodyset/thigh</socket_parent_frame>
        <socket_child_frame>/bodyset/shank</socket_child_frame>
        <coordinates> <Coordinate name="knee_angle"> <range>0 -2.1</range> </Coordinate> </coordinates>
    </PinJoint>
    ```

    ## Use instead
    ```xml
    <PinJoint name="knee">
        <socket_parent_frame>/bodyset/thigh</socket_parent_frame>
        <socket_child_frame>/bodyset/shank</socket_child_frame>
        <coordinates> <Coordinate name="knee_angle"> <range>-2.1 0</range> </Coordinate> </coordinates>
    </PinJoint>
    ```
    """
    for coordinate in subject.each(Coordinate):
        low, high = coordinate.range
        if low > high:
            refused = ": OpenSim refuses to load a clamped coordinate like this" if coordinate.clamped else ""
            found(
                f"the range of {called(coordinate)} runs from {quantity(low)} down to {quantity(high)}{refused}",
                coordinate,
                tag="range",
                severity=ERROR if coordinate.clamped else None,
                suggestion=(better := f"{shortest(high)} {shortest(low)}"),
                fix=replaced(subject.source, subject.position(coordinate, tag="range"), better, safe=False),
            )


@rule("OSIM512", "default-outside-range", severity=WARNING)
def default_outside_range(subject: Subject, found: Found) -> None:
    """The default value of a coordinate lies outside its range.

    ## What it does
    Reports such defaults; an error if the coordinate is clamped.

    ## Why is this bad
    OpenSim refuses to load a clamped coordinate like this. Otherwise the model starts in a pose that its own range
    rules out; often the range or the default is in degrees.

    ## Example
    ```xml
    <PinJoint name="knee">
        <socket_parent_frame>/bodyset/thigh</socket_parent_frame>
        <socket_child_frame>/bodyset/shank</socket_child_frame>
        <coordinates>
            <Coordinate name="knee_angle"> <default_value>0.3</default_value> <range>-2.1 0</range> </Coordinate>
        </coordinates>
    </PinJoint>
    ```

    ## Use instead
    ```xml
    <PinJoint name="knee">
        <socket_parent_frame>/bodyset/thigh</socket_parent_frame>
        <socket_child_frame>/bodyset/shank</socket_child_frame>
        <coordinates>
            <Coordinate name="knee_angle"> <default_value>-0.3</default_value> <range>-2.1 0</range> </Coordinate>
        </coordinates>
    </PinJoint>
    ```
    """
    for coordinate in subject.each(Coordinate):
        low, high = coordinate.range
        slack = 1e-9 * max(abs(low), abs(high), 1.0) if math.isfinite(low) and math.isfinite(high) else 0.0
        if low <= high and not low - slack <= coordinate.default_value <= high + slack:
            if not math.isfinite(coordinate.default_value):
                continue
            refused = ": OpenSim refuses to load a clamped coordinate like this" if coordinate.clamped else ""
            found(
                f"the default value of {called(coordinate)}, {quantity(coordinate.default_value)}, is outside its "
                f"range, {quantity(low)} to {quantity(high)}{refused}",
                coordinate,
                tag="default_value",
                severity=ERROR if coordinate.clamped else None,
            )


@rule("OSIM513", "prescribed-without-function", severity=ERROR)
def prescribed_without_function(subject: Subject, found: Found) -> None:
    """A coordinate is prescribed and has no function.

    ## What it does
    Reports coordinates with `<prescribed>true</prescribed>` and no `<prescribed_function>`.

    ## Why is this bad
    OpenSim switches the prescription off in silence, and the coordinate moves freely.

    ## Example
    ```xml
    <PinJoint name="knee">
        <socket_parent_frame>/bodyset/thigh</socket_parent_frame>
        <socket_child_frame>/bodyset/shank</socket_child_frame>
        <coordinates> <Coordinate name="knee_angle"> <prescribed>true</prescribed> </Coordinate> </coordinates>
    </PinJoint>
    ```

    ## Use instead
    ```xml
    <PinJoint name="knee">
        <socket_parent_frame>/bodyset/thigh</socket_parent_frame>
        <socket_child_frame>/bodyset/shank</socket_child_frame>
        <coordinates>
            <Coordinate name="knee_angle">
                <prescribed_function> <Constant> <value>-0.5</value> </Constant> </prescribed_function>
                <prescribed>true</prescribed>
            </Coordinate>
        </coordinates>
    </PinJoint>
    ```
    """
    for coordinate in subject.each(Coordinate):
        if coordinate.prescribed and coordinate.prescribed_function is None:
            found(
                f"{called(coordinate)} is prescribed without a prescribed_function: OpenSim lets it move freely",
                coordinate,
                tag="prescribed",
            )


@rule("OSIM514", "degrees-for-radians", severity=WARNING)
def degrees_for_radians(subject: Subject, found: Found) -> None:
    """An angle looks as if it were in degrees.

    ## What it does
    Reports rotational coordinates whose default value or range goes beyond five turns, in radians.

    ## Why is this bad
    Coordinates are in radians (only the limits of a CoordinateLimitForce are in degrees); 90 is more than fourteen
    turns.

    ## Example
    ```xml
    <PinJoint name="knee">
        <socket_parent_frame>/bodyset/thigh</socket_parent_frame>
        <socket_child_frame>/bodyset/shank</socket_child_frame>
        <coordinates> <Coordinate name="knee_angle"> <range>-120 0</range> </Coordinate> </coordinates>
    </PinJoint>
    ```

    ## Use instead
    ```xml
    <PinJoint name="knee">
        <socket_parent_frame>/bodyset/thigh</socket_parent_frame>
        <socket_child_frame>/bodyset/shank</socket_child_frame>
        <coordinates> <Coordinate name="knee_angle"> <range>-2.0943951 0</range> </Coordinate> </coordinates>
    </PinJoint>
    ```
    """
    turns = 10 * math.pi
    for joint in subject.each(Joint):
        for coordinate, motion in zip(joint.coordinates, joint.motion_types or (), strict=False):
            if motion != "rotational":
                continue
            largest = max((abs(bound) for bound in coordinate.range if math.isfinite(bound)), default=0.0)
            # 99999.9 and the like stand for "no bound".
            if turns < largest < 1000:
                found(
                    f"the range of {called(coordinate)}, {quantity(coordinate.range)}, is in radians; in degrees?",
                    coordinate,
                    tag="range",
                    suggestion=" ".join(f"{math.radians(bound):.6g}" for bound in coordinate.range),
                )
            if turns < abs(coordinate.default_value) < math.inf:
                found(
                    f"the default value of {called(coordinate)}, {quantity(coordinate.default_value)}, is in radians; "
                    "in degrees?",
                    coordinate,
                    tag="default_value",
                    suggestion=f"{math.radians(coordinate.default_value):.6g}",
                )


def _drives(subject: Subject, material: HuntCrossleyContactParameters) -> bool:
    """Whether friction at the smallest speeds acts along the sliding, even with the viscous part."""
    force = subject.owner(material)
    viscous = material.viscous_friction * force.transition_velocity if isinstance(force, HuntCrossleyForce) else 0.0
    return 2 * material.static_friction + viscous < material.dynamic_friction


def _limited(subject: Subject, force: CoordinateLimitForce) -> tuple[Coordinate | None, str | None]:
    """The coordinate a limit force acts on, and the motion it stands for (None if the joint's functions decide)."""
    spec = CoordinateLimitForce.field_specs()["coordinate"]
    coordinate = subject.tree.resolve(Use(force, force, spec, force.coordinate)).target
    if not isinstance(coordinate, Coordinate):
        return None, None
    joint = subject.tree.parent_of(coordinate)
    if not isinstance(joint, Joint) or joint.motion_types is None:
        return coordinate, None
    place = joint.coordinates.index(coordinate)
    return coordinate, joint.motion_types[place] if place < len(joint.motion_types) else None
