"""Results in the formats of others: a research object (RO-Crate) and the digital SI (D-SI)."""
