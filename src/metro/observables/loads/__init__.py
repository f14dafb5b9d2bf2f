"""Static load tests: the compliance of the tip where it was loaded, compared with nothing that is predicted.

``TABLES``: the tables that ``observe`` may write.
"""

NAME = "loads"
TABLES = ("load_points",)
