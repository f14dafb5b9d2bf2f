"""A milling cell with a dynamometer: spindle, tool, metal, table and amplifier, and what its batches hide."""
