"""What the kernels work on: three vectors.

A mechanism is a tree of links. A link is one body, or several that never move in one another, and
has its frame where the last motion of its joint ends. The way from the carrying link to it is a
list of operations: each is a fixed transform and then one motion, about the z axis or along any
axis if it has one. The degrees of freedom are numbered in the order of the links, so that what
carries stands before what is carried. Whatever pushes is an item.

The integers `model` say what is connected to what, and where everything is in the other two; the
numbers `reals` hold masses, places, parameters of forces, in SI units; `data` is what an evaluation
leaves behind. Models of one structure differ in `reals` only. Spatial vectors stack the angular
part over the linear part; velocities, accelerations, inertias and wrenches of a link are along the
axes of ground and about an origin that stays in ground: the place of the first link of its tree, so
that no digits are lost far away from ground's own origin.
"""

from __future__ import annotations

from functools import cache
from itertools import accumulate, count, islice


class Record(type):
    """The metaclass of records: their attributes are offsets of fields, or numbers that stand for something.

    Compiled kernels take one as they take a module, so that a field is a constant there.
    """

    def record(cls, **values: int) -> list[int]:
        """A record of these fields, in the order in which they are declared, up to SIZE or OWN.

        Raises:
            TypeError: a field is missing, or none has the name.
        """
        names = _names(cls)
        if len(values) != len(names) or not values.keys() >= {*names}:
            raise TypeError(
                f"{cls.__name__} has the fields {', '.join(names)}; got {', '.join(values)}"
            )
        return [values[name] for name in names]


@cache
def _names(record: Record) -> tuple[str, ...]:
    """The fields of a record by their offsets."""
    numbers = {name: number for name, number in vars(record).items() if name.isupper()}
    end = numbers["SIZE" if "SIZE" in numbers else "OWN"]
    offsets = {number: name for name, number in numbers.items() if 0 <= number < end}
    return tuple(offsets[number] for number in range(end))


# Integers: a head with counts and offsets, then records.
class MODEL(metaclass=Record):
    """The head of the model: counts, and where all else is."""

    _at = count()
    LINKS, DOFS, ITEMS, CONTACTS = islice(_at, 4)
    """How many there are: links, degrees of freedom, items (forces and the like), contacts."""
    LINK_AT, OPERATION_AT, DOF_AT, ITEM_AT = islice(_at, 4)
    """Offsets of the records in the model; at ITEM_AT are the offsets of the items' records."""
    SUMMED, SUMMED_AT = islice(_at, 2)
    """Count and offset of a list of the degrees of freedom whose columns are sums of several."""
    FIXED_AT = next(_at)
    """Offset in reals of the fixed transforms of the operations, by rows and then the translation,
    and of axes of slides (K, 15), see `FIXED`.
    """
    WORK_LINK, WORK_OPERATION, WORK_COLUMN, WORK_PIVOT, WORK_CONTACT, WORK_STATE = islice(_at, 6)
    """Offsets in the data of what is computed for links, operations, columns, pivots, contacts and states."""
    WORK_SIZE = next(_at)
    """Length of the data."""
    CONTACT_AT = next(_at)
    """Where the offsets of the records of the pairs stand, by contact."""
    CONSTRAINED = next(_at)
    """Offset of the record of all constraints, 0 if there are none."""
    STATE_SIZE = next(_at)
    """Length of a state: values, speeds, and auxiliary states."""
    CONTROLS, WORK_CONTROL = islice(_at, 2)
    """Offset of the record of the controls, 0 if there are none; offset in data of the controls."""
    EQUILIBRIA, EQUILIBRIUM_AT = islice(_at, 2)
    """Count and offset of what can be brought into equilibrium, see `EQUILIBRIUM`."""
    CHAIN = next(_at)
    """Offset of the record of the joints of another program that gives the mass matrix and the
    bias, 0 if there is none.
    """
    RESPONSES, RESPONSE_AT = islice(_at, 2)
    """Count and offset of the forces that push along one displacement, see `RESPONSE`."""
    RUNS, RUN_AT = islice(_at, 2)
    """Count and offset of runs of items that follow one another, see `RUN`."""
    LAWS = next(_at)
    """From here on the addresses of the laws, by their number."""


class LINK(metaclass=Record):
    """Integers of a link: its parent (-1 is ground), the ranges of its operations and of its degrees of freedom."""

    PARENT, FIRST_OPERATION, END_OPERATION, FIRST_DOF, END_DOF, SIZE = range(6)


class OPERATION(metaclass=Record):
    """Integers of an operation, one motion of a joint.

    Its motion, the kind of its fixed transform, the degree of freedom that is its amount or -1, the
    law that gives the amount otherwise or the motion of a ball; offset and number of the arguments
    in the model (degrees of freedom, -1 for a number that does not change); offset in reals of the
    radii, or of the values of such arguments and the table of the function after them; offset in
    data of the gradient.
    """

    MOTION, BEFORE, DOF, FUNCTION, ARGUMENTS, ARGUMENT_COUNT, EXTRA, GRADIENT, SIZE = range(9)
    ALONE, TOGETHER = -1, -2
    """In place of the law: the column of the degree of freedom comes from this operation only, or from several."""


class DOF(metaclass=Record):
    """Of a degree of freedom: the next one on the way to ground or -1, offset in data of its row of
    the mass matrix, and how many there are on the way.
    """

    ABOVE, ROW, DEPTH, SIZE = range(4)


class ITEM(metaclass=Record):
    """Of an item: address of its kernel, offsets in reals and data of what it owns there, number of
    the first contact of its element, and from OWN on integers of its own. The record of the
    controls is like one.
    """

    LAW, NUMBERS, RECORD, FIRST_CONTACT, OWN = range(5)


class EQUILIBRIUM(metaclass=Record):
    """Of what can be brought into equilibrium: the address of the kernel that does it, and the offset of its item."""

    KERNEL, ITEM, SIZE = range(3)


class RESPONSE(metaclass=Record):
    """Of a force that pushes along one displacement: the address of the kernel that finds its
    derivatives, the offset of its item, the offset among the item's integers of the first of those
    that say where its states are, their count, and -1 if it pulls against the displacement, else 1.
    """

    KERNEL, ITEM, FIRST_STATE, STATES, SENSE, SIZE = range(6)


class RUN(metaclass=Record):
    """Of items that are computed one after another: address of the kernel that computes all of them
    at once, 0 if each is computed by its own; numbers of the first and the end; offset in data of
    room for curves, see `batched_curves`.
    """

    LAW, FIRST, END, ROOM, SIZE = range(5)


class CONSTRAINED(metaclass=Record):
    """Of all constraints."""

    _at = count()
    DYNAMICS, PROJECT, CONSTRAINTS, CONSTRAINT_AT = islice(_at, 4)
    """The laws that find accelerations and that project states; count of the constraints, and where
    the offsets of their records stand.
    """
    EQUATIONS, POSITIONS, LOCKS, BALLS, BALL_AT, ENTRIES = islice(_at, 6)
    """Counts of the equations, of those that bind positions, and of coordinates that are just
    locked; count of the balls, and where the offsets of their arguments stand; count of the numbers
    of the mass matrix.
    """
    WORK_ROWS, WORK_ERRORS, WORK_RATES, WORK_DRIFTS = islice(_at, 4)
    """Offsets in data of G (m, n), of the errors, and of what G u and G udot are to be."""
    WORK_KEPT, WORK_FACTOR, WORK_SYSTEM, WORK_TRIAL = islice(_at, 4)
    """Offsets in data of scratch: for (m, n) numbers, for a factor of them, for solving, for states."""
    FACTORISE, MINIMUM_NORM = islice(_at, 2)
    """The laws that factorise equations, and that solve them then."""
    SIZE = next(_at)


class CONSTRAINT(metaclass=Record):
    """Of a constraint: its law and the offset of its numbers; its equations, of which those up to
    the second end bind positions, and from OWN on integers of its own.
    """

    LAW, NUMBERS, FIRST_EQUATION, END_EQUATION, END_POSITION, OWN = range(6)


class COORDINATE(metaclass=Record):
    """Of a coordinate in a constraint: its degree of freedom, the place of the arguments of its
    ball or -1, and its number among these.
    """

    DOF, BALL, PART, SIZE = range(4)


class CHAIN(metaclass=Record):
    """Of the joints of another program."""

    _at = count()
    DYNAMICS, SUPPLY, JOINTS, JOINT_AT = islice(_at, 4)
    SHARES, SHARE_AT, PRODUCTS, PRODUCT_AT, EXCESSES, EXCESS_AT = islice(_at, 6)
    """The law that finds the mass matrix, the address of the kernel that asks the other program;
    counts and offsets of their records, of pairs of a joint and a degree of freedom that moves it,
    of products of two such shares, and of links to which the other program gives too much inertia.
    """
    WORK_JOINTS, WORK_SHARES, ENTRY_AT, END_ENTRY = islice(_at, 4)
    """Offsets in data: of values, rates, accelerations without udot and forces of all joints and
    then the mass matrix, of the shares, and of the rows of our own mass matrix and their end.
    """
    SIZE = next(_at)


class JOINT(metaclass=Record):
    """Of a joint: what it is a part of, number of that degree of freedom or operation, which part
    or the offset in reals of a factor, and its first share.
    """

    KIND, SOURCE, PART, FIRST_SHARE, SIZE = range(5)


class SHARE(metaclass=Record):
    """What a degree of freedom has in a joint."""

    JOINT, DOF, SIZE = range(3)


class PRODUCT(metaclass=Record):
    """Two shares, the entry of the other program's mass matrix that they take, and offset in data
    of what it adds to.
    """

    ONE, TWO, ENTRY, PLACE, SIZE = range(5)


class EXCESS(metaclass=Record):
    """A link, the last degree of freedom on the way to it, and offset in reals of what its inertia is too large by."""

    LINK, DOF, NUMBER, SIZE = range(4)


class JOINT_KIND(metaclass=Record):
    """A multiple of a degree of freedom, the amount of an operation, an angle of a ball, a
    component of where its end lies on the ellipsoid, a component of the error of a drift.
    """

    LINE, AMOUNT_OF, ANGLE, ELLIPSOID, ERROR = range(5)


# Numbers.
GRAVITY_AT, INERTIA_AT = 0, 3
"""Gravity in ground (3,), and of each link its `INERTIA`."""


class INERTIA(metaclass=Record):
    """Mass, mass centre in the link, xx, yy, zz, xy, xz, yz about it."""

    MASS, CENTER, MOMENTS, SIZE = accumulate((1, 3, 6), initial=0)


class FIXED(metaclass=Record):
    """Of an operation: rotation by rows and translation of its fixed transform, and the axis of a slide."""

    ROTATION, TRANSLATION, AXIS, SIZE = accumulate((9, 3, 3), initial=0)


class WORK(metaclass=Record):
    """The head of the data: the time (s), and room for what laws hand over."""

    TIME, SCRATCH, SIZE = accumulate((1, 31), initial=0)


class LINK_WORK(metaclass=Record):
    """Of a link: rotation in ground by rows, position of its origin, origin of the spatial vectors,
    velocity, acceleration while the derivatives of all speeds are zero (upwards against gravity);
    inertia (mass, first moment, xx, yy, zz, xy, xz, yz) and wrench of it, and of all that it
    carries too after the evaluation.
    """

    ROTATION, POSITION, ORIGIN, VELOCITY, ACCELERATION, INERTIA, WRENCH, SIZE = accumulate(
        (9, 3, 3, 6, 6, 10, 7), initial=0
    )


class OPERATION_WORK(metaclass=Record):
    """Work of an operation: the axis, or the frame by rows whose axes a ball's speeds are about;
    where that is; amount, rate and second derivative without udot, if a function gives them.
    """

    AXIS, POINT, AMOUNT, RATE, CURVATURE, SIZE = accumulate((9, 3, 1, 1, 2), initial=0)


class CONTACT_WORK(metaclass=Record):
    """Work of a contact: force on surface 2, its point, depth and radius of the law; force and
    depth are 0 without contact.
    """

    FORCE, DEPTH, RADIUS, SIZE = accumulate((6, 1, 1), initial=0)


# Kinds.
class MOTION(metaclass=Record):
    """Motions: about z, along an axis (those before BALL have one axis), a SphericalMotion, one
    that is passed from end to start, a SimbodyAccelerationError.
    """

    TURN, SLIDE, BALL, BALL_BACK, ACCELERATION_ERROR = range(5)


class TRANSFORM(metaclass=Record):
    """Fixed transforms: none, a translation, any."""

    NOTHING, SHIFT, MOVE = range(3)


class OUTCOME(metaclass=Record):
    """What becomes of an evaluation: good, a degree of freedom moves no mass, the rates of a ball
    are not defined; of a
    projection: too far from where the constraints hold; of a kernel in Python: it raised an error;
    of an item: its law has no solution.
    """

    OK, SINGULAR_MASS, SINGULAR_RATES, FAR, FAILED, UNSOLVED = range(6)


class STAGE(metaclass=Record):
    """How far an evaluation goes: to the accelerations, to the positions of the links, to the
    forces (those that items apply are then in place of the accelerations), to the velocities.
    """

    ACCELERATION, POSITION, FORCE, VELOCITY = range(4)
