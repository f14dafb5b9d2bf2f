"""The observables: what was measured and can be predicted, each joining one kind of table to one model.

``PACKAGES``: the package of each observable, in the contract's order. A new observable is a package here and
one line.
"""

PACKAGES = (
    "force",
    "joint_force",
    "deformation",
    "waviness",
    "flatness",
    "stability",
)
