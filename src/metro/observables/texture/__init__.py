"""Surface texture of traced profiles: parameters that need nothing but the trace, and are compared with none.

``TABLES``: the tables that ``observe`` may write.
"""

NAME = "texture"
TABLES = ("profile_parameters", "profile_traces")
