"""Areal parameters of scans that are rasters; nothing is predicted."""
