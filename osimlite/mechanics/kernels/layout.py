"""Layout of the three vectors that all kernels work on: `model`, `reals` and `data`.

- `model` (integers): the structure of the mechanism, and the offsets of all else.
- `reals` (floats): masses, positions, parameters of forces, in SI units. Models of one structure
  differ in `reals` only.
- `data` (floats): results of an evaluation, and workspace. Records in it are named ..._WORK.

A mechanism is a tree of links. A link is one body, or several that never move relative to each
other; its frame is where the last motion of its joint ends. The path from the parent to a link is a
list of operations, each of which is a fixed transform and then one motion, about the z axis or
along an axis. Degrees of freedom are numbered in the order of the links, so that parents come
before children. Everything that applies loads, or is computed with them, is an item.

Spatial vectors stack the angular part over the linear part. Velocities, accelerations, inertias and
wrenches of a link are along the axes of ground and about a point that is fixed in ground: the
position of the first link of its tree, so that no digits are lost far from the origin of ground.
"""

from __future__ import annotations

from functools import cache
from itertools import accumulate, count


class Record(type):
    """Metaclass of records, whose attributes are offsets of fields or numbers of alternatives.

    Compiled kernels use such a class like a module, so that a field is a constant there.
    """

    def record(cls, **values: int) -> list[int]:
        """Return the integers of a record in the order of its fields, up to SIZE or DETAILS.

        Raises:
            TypeError: a field is missing, or an unknown one is given.
        """
        names = _list_fields(cls)
        if len(values) != len(names) or not values.keys() >= {*names}:
            raise TypeError(
                f"{cls.__name__} has the fields {', '.join(names)}; got {', '.join(values)}"
            )
        return [values[name] for name in names]


@cache
def _list_fields(record: Record) -> tuple[str, ...]:
    """Return the names of the fields of a record, sorted by their offsets."""
    numbers = {name: number for name, number in vars(record).items() if name.isupper()}
    end = numbers["SIZE" if "SIZE" in numbers else "DETAILS"]
    offsets = {number: name for name, number in numbers.items() if 0 <= number < end}
    return tuple(offsets[number] for number in range(end))


# Records of integers in `model`: a head with counts and offsets, then all others.
class MODEL(metaclass=Record):
    """Head of the model: counts, and the offsets of all other records."""

    _at = count()
    LINKS = next(_at)
    """Number of links."""
    DOFS = next(_at)
    """Number n of degrees of freedom."""
    ITEMS = next(_at)
    """Number of items: forces, probes and the functions that they call."""
    CONTACTS = next(_at)
    """Number of pairs of contact surfaces."""
    LINK_AT = next(_at)
    """Offset of the records of the links, see `LINK`."""
    OPERATION_AT = next(_at)
    """Offset of the records of the operations, see `OPERATION`."""
    DOF_AT = next(_at)
    """Offset of the records of the degrees of freedom, see `DOF`."""
    ITEM_AT = next(_at)
    """Offset of a list of the offsets of the items' records, see `ITEM`."""
    SUMMED = next(_at)
    """Number of degrees of freedom whose columns are sums over several operations."""
    SUMMED_AT = next(_at)
    """Offset of the list of these degrees of freedom."""
    FIXED_AT = next(_at)
    """Offset in reals of the fixed transforms of the operations (K, 15), see `FIXED`."""
    WORK_LINK = next(_at)
    """Offset in data of the results of the links, see `LINK_WORK`."""
    WORK_OPERATION = next(_at)
    """Offset in data of the results of the operations, see `OPERATION_WORK`."""
    WORK_COLUMN = next(_at)
    """Offset in data of the columns (n, 6): twist per unit of each speed."""
    WORK_PIVOT = next(_at)
    """Offset in data of the diagonal of the mass matrix before its factorization (n,)."""
    WORK_CONTACT = next(_at)
    """Offset in data of the results of the contacts, see `CONTACT_WORK`."""
    WORK_STATE = next(_at)
    """Offset in data of workspace for states."""
    WORK_SIZE = next(_at)
    """Length of data."""
    CONTACT_AT = next(_at)
    """Offset of a list of the offsets of the contacts' items."""
    CONSTRAINED = next(_at)
    """Offset of the record of all constraints, 0 if there are none."""
    STATE_SIZE = next(_at)
    """Length of a state: values, speeds, and auxiliary states."""
    CONTROLS = next(_at)
    """Offset of the record of the controls, 0 if there are none."""
    WORK_CONTROL = next(_at)
    """Offset in data of the controls."""
    EQUILIBRIA = next(_at)
    """Number of items that can be brought into equilibrium."""
    EQUILIBRIUM_AT = next(_at)
    """Offset of their records, see `EQUILIBRIUM`."""
    CHAIN = next(_at)
    """Offset of the record of another program that gives the mass matrix, 0 if there is none, see `CHAIN`."""
    RESPONSES = next(_at)
    """Number of forces along one displacement that implicit integrators differentiate."""
    RESPONSE_AT = next(_at)
    """Offset of their records, see `RESPONSE`."""
    RUNS = next(_at)
    """Number of runs of consecutive items."""
    RUN_AT = next(_at)
    """Offset of their records, see `RUN`."""
    LAWS = next(_at)
    """Offset of the addresses of the laws, by their numbers in the table."""


class LINK(metaclass=Record):
    """Integers of a link.

    Attributes:
        PARENT: number of the parent link, -1 for ground.
        FIRST_OPERATION, END_OPERATION: range of the operations of the link.
        FIRST_DOF, END_DOF: range of the degrees of freedom of the link.
    """

    PARENT, FIRST_OPERATION, END_OPERATION, FIRST_DOF, END_DOF, SIZE = range(6)


class OPERATION(metaclass=Record):
    """Integers of an operation, one motion of a joint.

    Attributes:
        MOTION: type of the motion, see `MOTION`.
        BEFORE: type of the fixed transform before the motion, see `TRANSFORM`.
        DOF: degree of freedom that is the amount of the motion, or -1.
        FUNCTION: number of the law that gives the amount or the motion of a ball; or SINGLE, SUMMED.
        ARGUMENTS, ARGUMENT_COUNT: offset in the model and number of the arguments of that law, which
            are degrees of freedom or -1 for a constant one.
        EXTRA: offset in reals of the radii, or of constant arguments and then the function's table.
        GRADIENT: offset in data of the gradient of the amount.
    """

    MOTION, BEFORE, DOF, FUNCTION, ARGUMENTS, ARGUMENT_COUNT, EXTRA, GRADIENT, SIZE = range(9)
    SINGLE = -1
    """FUNCTION if the column of the degree of freedom comes from this operation only."""
    SUMMED = -2
    """FUNCTION if the column of the degree of freedom is a sum over several operations."""


class DOF(metaclass=Record):
    """Integers of a degree of freedom.

    Attributes:
        ABOVE: next degree of freedom on the path to ground, or -1.
        ROW: offset in data of the row of the degree of freedom in the mass matrix.
        DEPTH: number of degrees of freedom on the path to ground above this one.
    """

    ABOVE, ROW, DEPTH, SIZE = range(4)


class ITEM(metaclass=Record):
    """Integers of an item, or of the controls.

    Attributes:
        LAW: address of the kernel of the item.
        NUMBERS, RECORD: offsets of the item's parameters in reals and of its results in data.
        FIRST_CONTACT: number of the first contact of the force element.
        DETAILS: offset of further integers that depend on the kernel.
    """

    LAW, NUMBERS, RECORD, FIRST_CONTACT, DETAILS = range(5)


class EQUILIBRIUM(metaclass=Record):
    """Integers of an item that can be brought into equilibrium.

    Attributes:
        KERNEL: address of the kernel that sets the item's states to equilibrium.
        ITEM: offset of the item.
    """

    KERNEL, ITEM, SIZE = range(3)


class RESPONSE(metaclass=Record):
    """Integers of a force along one displacement.

    Attributes:
        KERNEL: address of the kernel that computes the derivatives of the force.
        ITEM: offset of the item of the force.
        FIRST_STATE, STATES: offset among the item's integers of the indices of the force's states,
            and number of these states.
        SENSE: -1 if the force pulls against the displacement, else 1.
    """

    KERNEL, ITEM, FIRST_STATE, STATES, SENSE, SIZE = range(6)


class RUN(metaclass=Record):
    """Integers of a run of consecutive items.

    Attributes:
        LAW: address of the kernel that computes all items of the run at once, 0 if each has its own
            kernel.
        FIRST, END: range of the items.
        WORKSPACE: offset in data of workspace for curves, see `batched_curves`.
    """

    LAW, FIRST, END, WORKSPACE, SIZE = range(5)


class CONSTRAINED(metaclass=Record):
    """Integers of all constraints together."""

    _at = count()
    DYNAMICS = next(_at)
    """Number of the law that computes accelerations."""
    PROJECT = next(_at)
    """Number of the law that projects states onto the constraints."""
    CONSTRAINTS = next(_at)
    """Number of constraints."""
    CONSTRAINT_AT = next(_at)
    """Offset of a list of the offsets of the constraints' records, see `CONSTRAINT`."""
    EQUATIONS = next(_at)
    """Number m of equations."""
    POSITIONS = next(_at)
    """Number of equations that constrain positions."""
    LOCKS = next(_at)
    """Number of coordinates that are just locked."""
    BALLS = next(_at)
    """Number of ball joints."""
    BALL_AT = next(_at)
    """Offset of a list of the offsets of the balls' degrees of freedom."""
    ENTRIES = next(_at)
    """Number of stored entries of the mass matrix."""
    WORK_ROWS = next(_at)
    """Offset in data of the matrix G (m, n)."""
    WORK_ERRORS = next(_at)
    """Offset in data of the errors of the equations (m,)."""
    WORK_RATES = next(_at)
    """Offset in data of the prescribed values of G u (m,)."""
    WORK_DRIFTS = next(_at)
    """Offset in data of the required values of G udot (m,)."""
    WORK_COPY = next(_at)
    """Offset in data of workspace for a copy of rows (m, n)."""
    WORK_FACTOR = next(_at)
    """Offset in data of workspace for a factor of (m, n) equations."""
    WORK_SYSTEM = next(_at)
    """Offset in data of workspace for linear systems."""
    WORK_TRIAL = next(_at)
    """Offset in data of workspace for states."""
    FACTORISE = next(_at)
    """Number of the law that factorises equations."""
    MINIMUM_NORM = next(_at)
    """Number of the law that solves factorised equations."""
    SIZE = next(_at)


class CONSTRAINT(metaclass=Record):
    """Integers of a constraint.

    Attributes:
        LAW, NUMBERS: number of the constraint's law, and offset of its parameters in reals.
        FIRST_EQUATION, END_EQUATION: range of the constraint's equations.
        END_POSITION: end of the equations that constrain positions.
        DETAILS: offset of further integers that depend on the law.
    """

    LAW, NUMBERS, FIRST_EQUATION, END_EQUATION, END_POSITION, DETAILS = range(6)


class COORDINATE(metaclass=Record):
    """Integers of a coordinate in a constraint.

    Attributes:
        DOF: degree of freedom, -1 for a locked coordinate.
        BALL: offset of the degrees of freedom of the ball joint that the coordinate belongs to, or
            -1.
        PART: index of the coordinate among the angles of this ball joint.
    """

    DOF, BALL, PART, SIZE = range(4)


class CHAIN(metaclass=Record):
    """Integers of another program with one-axis joints, see :mod:`osimlite.mechanics.kernels.chain`."""

    _at = count()
    DYNAMICS = next(_at)
    """Number of the law that computes the mass matrix."""
    SUPPLY = next(_at)
    """Address of the kernel that obtains joint forces and mass matrix from the other program."""
    JOINTS = next(_at)
    """Number of joints."""
    JOINT_AT = next(_at)
    """Offset of the records of the joints, see `JOINT`."""
    DERIVATIVES = next(_at)
    """Number of pairs of a joint and a degree of freedom that moves it."""
    DERIVATIVE_AT = next(_at)
    """Offset of their records, see `JOINT_DERIVATIVE`."""
    PRODUCTS = next(_at)
    """Number of products of two derivatives."""
    PRODUCT_AT = next(_at)
    """Offset of their records, see `PRODUCT`."""
    EXCESSES = next(_at)
    """Number of links to which the other program gives too much inertia."""
    EXCESS_AT = next(_at)
    """Offset of their records, see `EXCESS`."""
    WORK_JOINTS = next(_at)
    """Offset in data of values, rates, accelerations while udot = 0, and forces of all joints.

    The mass matrix of the other program follows them.
    """
    WORK_DERIVATIVES = next(_at)
    """Offset in data of the values of these derivatives."""
    ENTRY_AT = next(_at)
    """Offset in data of the mass matrix of the degrees of freedom."""
    END_ENTRY = next(_at)
    """End in data of this mass matrix."""
    SIZE = next(_at)


class JOINT(metaclass=Record):
    """Integers of a joint of another program.

    Attributes:
        KIND: source type, see `JOINT_SOURCE`.
        SOURCE: index of the degree of freedom or operation that the joint follows.
        PART: component of the operation, or offset in reals of the factor of a degree of freedom.
        FIRST_DERIVATIVE: index of the first derivative of the joint.
    """

    KIND, SOURCE, PART, FIRST_DERIVATIVE, SIZE = range(5)


class JOINT_DERIVATIVE(metaclass=Record):
    """Integers of the derivative of a joint by a degree of freedom.

    Attributes:
        JOINT: number of the joint.
        DOF: degree of freedom, or -1 for a constant argument.
    """

    JOINT, DOF, SIZE = range(3)


class PRODUCT(metaclass=Record):
    """Integers of a product of two derivatives of joints.

    Attributes:
        ONE, TWO: numbers of the derivatives.
        ENTRY: entry of the other program's mass matrix by which the product is multiplied.
        TARGET: offset in data of the entry of the mass matrix that the product is added to.
    """

    ONE, TWO, ENTRY, TARGET, SIZE = range(5)


class EXCESS(metaclass=Record):
    """Integers of a link whose inertia is too large in the other program.

    Attributes:
        LINK: number of the link.
        DOF: last degree of freedom on the path to the link.
        NUMBER: offset in reals of the excess moment of inertia (kg m²).
    """

    LINK, DOF, NUMBER, SIZE = range(4)


class JOINT_SOURCE(metaclass=Record):
    """Sources that a joint of another program can follow.

    Attributes:
        LINE: a multiple of a degree of freedom.
        AMOUNT_OF: the amount of an operation.
        ANGLE: an angle of a ball.
        ELLIPSOID: a component of the position of an ellipsoid joint.
        ERROR: a component of the error of a drift.
    """

    LINE, AMOUNT_OF, ANGLE, ELLIPSOID, ERROR = range(5)


# Records of floats in `reals` and `data`.


class REALS(metaclass=Record):
    """Start of reals."""

    GRAVITY = 0
    """Gravity in ground (3,), m/s²."""
    INERTIA = 3
    """Inertias of the links, see `INERTIA`."""


class INERTIA(metaclass=Record):
    """Inertia of a link in reals, in its frame.

    Attributes:
        MASS: mass (kg).
        CENTER: mass centre (m).
        MOMENTS: moments xx, yy, zz and products xy, xz, yz of inertia about the mass centre (kg m²).
    """

    MASS, CENTER, MOMENTS, SIZE = accumulate((1, 3, 6), initial=0)


class FIXED(metaclass=Record):
    """Fixed transform of an operation in reals.

    Attributes:
        ROTATION: rotation by rows.
        TRANSLATION: translation (m).
        AXIS: axis of a slide.
    """

    ROTATION, TRANSLATION, AXIS, SIZE = accumulate((9, 3, 3), initial=0)


class WORK(metaclass=Record):
    """Head of data.

    Attributes:
        TIME: time (s).
        SCRATCH: workspace by which laws exchange arguments and results.
    """

    TIME, SCRATCH, SIZE = accumulate((1, 31), initial=0)


class LINK_WORK(metaclass=Record):
    """Results of a link, along the axes of ground.

    Attributes:
        ROTATION: rotation in ground by rows.
        POSITION: position of the link's origin (m).
        ORIGIN: point of ground about which the link's spatial vectors are taken (m).
        VELOCITY: spatial velocity.
        ACCELERATION: spatial acceleration while udot = 0, relative to free fall.
        INERTIA: mass, first moment, xx, yy, zz, xy, xz, yz; of its subtree after the evaluation.
        WRENCH: torque and force; of its subtree after the evaluation.
    """

    ROTATION, POSITION, ORIGIN, VELOCITY, ACCELERATION, INERTIA, WRENCH, SIZE = accumulate(
        (9, 3, 3, 6, 6, 10, 7), initial=0
    )


class OPERATION_WORK(metaclass=Record):
    """Results of an operation.

    Attributes:
        AXIS: axis in ground, or the frame by rows whose axes the speeds of a ball are about.
        POINT: position of the axis or frame in ground (m).
        AMOUNT, RATE, CURVATURE: amount, its rate and its second derivative while udot = 0, if a
            function gives them.
    """

    AXIS, POINT, AMOUNT, RATE, CURVATURE, SIZE = accumulate((9, 3, 1, 1, 2), initial=0)


class CONTACT_WORK(metaclass=Record):
    """Results of a contact; force and depth are 0 without contact.

    Attributes:
        FORCE: force on surface 2 (N), then the point where it acts (m).
        DEPTH: depth (m).
        RADIUS: effective radius of the law (m).
    """

    FORCE, DEPTH, RADIUS, SIZE = accumulate((6, 1, 1), initial=0)


# Alternatives.
class MOTION(metaclass=Record):
    """Types of motions; those before BALL have one axis.

    Attributes:
        TURN: rotation about z.
        SLIDE: translation along an axis.
        BALL: spherical or ellipsoidal motion.
        BALL_BACK: the same, traversed from its end to its start.
        ACCELERATION_ERROR: error of Simbody's acceleration of a CustomJoint.
    """

    TURN, SLIDE, BALL, BALL_BACK, ACCELERATION_ERROR = range(5)


class TRANSFORM(metaclass=Record):
    """Types of fixed transforms.

    Attributes:
        NOTHING: identity.
        SHIFT: translation.
        MOVE: rotation and translation.
    """

    NOTHING, SHIFT, MOVE = range(3)


class OUTCOME(metaclass=Record):
    """Outcomes of kernels.

    Attributes:
        OK: success.
        SINGULAR_MASS: a degree of freedom moves no mass.
        SINGULAR_RATES: the rates of a ball are not defined.
        FAR: a projection starts too far from the constraints.
        FAILED: a kernel in Python raised an error.
        UNSOLVED: the law of an item has no solution.
    """

    OK, SINGULAR_MASS, SINGULAR_RATES, FAR, FAILED, UNSOLVED = range(6)


class STAGE(metaclass=Record):
    """Last stage of an evaluation.

    Attributes:
        ACCELERATION: all stages, up to the accelerations.
        POSITION: the poses of the links.
        FORCE: positions, velocities and forces; f then holds the generalized forces.
        VELOCITY: positions and velocities.
    """

    ACCELERATION, POSITION, FORCE, VELOCITY = range(4)
