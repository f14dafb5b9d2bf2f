"""A machine at the boundary of chatter: resonances, wear, hammer and ears, and what its batches hide."""
