"""Stability: modes from impact tests, lobes, and cuts that chattered or not.

``TABLES``: the tables that ``observe`` may write.
"""

NAME = "lobes"
TABLES = (
    *("modes", "lobes", "frf_used", "stabilisation", "lobe_runs", "lobes_refused"),
    *("mode_shapes", "mode_mac", "lobe_methods", "lobe_islands", "lobe_stations"),
    *("mode_tracks", "mode_pickups", "mode_cross", "mode_notes"),
    *("chatter_runs", "chatter_records"),
)
