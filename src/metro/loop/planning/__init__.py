"""Which runs to make next: what they would decide, and how much they would narrow the intervals."""
