"""Waviness of machined walls, and the tracking error that predicts it.

``TABLES``: the tables that ``observe`` may write.
"""

NAME = "waviness"
TABLES = ("waviness_points", "waviness_runs", "waviness_refused")
