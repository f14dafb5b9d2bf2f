"""Faces by a level or an autocollimator: heights from slopes, compared with nothing that is predicted.

``TABLES``: the tables that ``observe`` may write.
"""

NAME = "levelling"
TABLES = ("level_heights", "level_readings")
