"""A cutting arm: joints, gears, hoses, links, controller and gauges, and what its batches hide."""
