"""Cutting force: dynamometer records, and the mechanistic model that predicts them.

``TABLES``: the tables that ``observe`` may write.
"""

NAME = "force"
TABLES = ("orders", "spindle", "force_refused", "yielding")
