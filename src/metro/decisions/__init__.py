"""What follows from results: conformity with the tolerances of a batch, and the cuts to use."""
