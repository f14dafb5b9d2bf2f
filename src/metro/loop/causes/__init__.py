"""Causes over several observables: their witnesses, and where an error comes from upstream."""
