"""Flatness of milled faces, and the tip compliance that predicts it.

``TABLES``: the tables that ``observe`` may write.
"""

NAME = "flatness"
TABLES = (
    *("face_indices", "face_map", "face_contacts", "face_placed", "face_points", "face_beside"),
    *("face_loads", "face_mass", "face_refused", "face_planned"),
)
