"""Poses of an arm that an instrument measured: calibrated, and proven on poses that were left out.

``TABLES``: the tables that ``observe`` may write.
"""

NAME = "pose"
TABLES = ("pose_errors", "pose_curves", "pose_next")
