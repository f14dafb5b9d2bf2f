"""Frequency responses, modes and stability lobes."""
