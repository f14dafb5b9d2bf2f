"""The observables: what was measured and can be predicted, each joining one kind of table to one model."""
