"""Closed-loop metrology for robotic machining: predict, compare, trace what is left to its cause."""

__version__ = "0.1.0"
