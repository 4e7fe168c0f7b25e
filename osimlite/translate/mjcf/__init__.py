"""MJCF, the models of MuJoCo.

A translation is a list of passes over a `Draft` (in `export`): each takes what it can say of the
model, adds elements to the draft and accounts for the components in the draft's fidelity. What no
pass speaks of is left out by name at the end. A kind of thing is added as one function in a module
of its own, and one place in the list.

What a pass finds in the draft: elements of bodies by index (`bodies`), the joint of a coordinate
(`leads`), frames by socket (`placement`), new names (`name`), sites (`site`), components that
nobody has spoken of (`components`), tendons of paths by their owners (`tendons`).

A path is read as the simulation reads it (`poses`) and becomes the nearest tendon (`routes`,
`surfaces`, `fits`), which is measured as MuJoCo would (`tendons`, `wrapping`) and written
(`paths`); muscles and springs act on it (`muscles`, `path_forces`).
"""
