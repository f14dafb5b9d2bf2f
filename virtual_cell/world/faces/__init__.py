"""A workshop that mills faces: arm, spindle, fixture and scanner, and what its batches hide."""
