"""Planes, flatness and profiles from point clouds and stylus traces."""
