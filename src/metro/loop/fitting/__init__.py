"""The joint fit: base parameters, effect parameters and each run's unknowns, under a noise model."""
