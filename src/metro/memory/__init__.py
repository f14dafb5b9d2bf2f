"""Campaign memory: parameters over the batches of one cell, tool or work, and what only all batches show."""
