"""The data contract: find batches, read and validate what describes them, and plan the hold-out."""
