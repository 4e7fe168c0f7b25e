"""What the laws of wrap surfaces are given and say: see `wrap_cylinder.py` and its neighbours.

A surface of a path is an item, whose law finds how a straight piece of the path bends around it.
All points are in the frame of the wrap object, in m. The numbers p of the item do not change:
p[AXIS] is the axis (0, 1, 2) of the quadrant and p[SIDE] its sign, 0.0 for all of the surface;
p[METHOD] is how an ellipsoid is wrapped, p[ALONE] is 1.0 if the path has no other PathWrap, and
from p[SIZES] on stand the dimensions (cylinder: radius, length; sphere: radius; ellipsoid: three
radii; torus: inner_radius, outer_radius). The record e of the item has the ends of the piece e[0:3]
and e[3:6], to which the law adds the tangent points e[6:9] and e[9:12], in the same order, the
length e[12] along the surface between them, and in e[CURVE:ROOM] what `wrap_curves.py` needs to
trace the way there; the rest, up to ENDS, is room of the law's own.

A law returns INSIDE if an end is inside the surface, NONE if the piece goes straight on, WRAPPED if
it may wrap, and MANDATORY if it must; what it leaves in e counts in the last two cases only. Where
OpenSim takes a piece to wrap but then finds no points, the tangent points are NaN: such a piece
goes straight on.
"""

AXIS, SIDE, METHOD, ALONE, SIZES = 0, 1, 2, 3, 4
HYBRID, MIDPOINT, AXIAL = 0.0, 1.0, 2.0

FIRST_END, SECOND_END, FIRST_TANGENT, SECOND_TANGENT, SURFACE_LENGTH, CURVE, ROOM, ENDS = (
    0,
    3,
    6,
    9,
    12,
    13,
    18,
    98,
)

INSIDE, NONE, WRAPPED, MANDATORY = -1, 0, 1, 2
