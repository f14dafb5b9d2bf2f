"""A simulator of raw batches, for demonstration and tests; it imports nothing of metro."""
