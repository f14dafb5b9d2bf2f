"""The things of a real cell, one module each: drawn from published ranges, and always there."""
