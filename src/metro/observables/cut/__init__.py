"""What several observables share of a cut: its conditions, its records, the force that they start from."""
