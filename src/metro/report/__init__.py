"""Figures, report templates and the campaign summary."""
