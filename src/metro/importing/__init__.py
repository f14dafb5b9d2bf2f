"""Files that nobody has described: looked at, a reading proposed, and written as a batch."""
