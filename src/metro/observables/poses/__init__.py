"""Poses of an arm that an instrument measured: calibrated, and proven on poses that were left out.

``TABLES``: the tables that ``observe`` may write; ``ERRORS``: that of errors on left-out poses.
"""

NAME = "pose"
ERRORS = "pose_errors"
TABLES = (ERRORS, "pose_curves", "pose_next", "pose_targets")
