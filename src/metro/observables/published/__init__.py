"""What others printed: their tables recomputed, and printed pairs compared like measurements.

``TABLES``: the tables that ``observe`` may write.
"""

TABLES = (
    *("published_errors", "published_modes", "published_loads", "published_matrices"),
    "published_forces",
)
