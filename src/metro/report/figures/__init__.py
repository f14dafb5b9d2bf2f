"""Figures: small pure functions, a frame in and a matplotlib Figure out."""
