"""Closed-loop metrology for robotic machining: predict, compare, trace the remaining error to its cause."""

__version__ = "0.1.0"
