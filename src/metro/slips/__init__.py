"""Mistakes of orientation and bookkeeping, found from what the data say against what the batch declares."""
