"""Deformation of machined walls, and the joints that give way.

``TABLES``: the tables that ``observe`` may write.
"""

NAME = "deformation"
TABLES = ("tip_force", "profile_points", "observability", "arm_loads", "deformation_refused")
