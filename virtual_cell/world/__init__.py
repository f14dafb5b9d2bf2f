"""The harder world: what real cells do, each thing of it drawn by a seed over the range that is published."""
