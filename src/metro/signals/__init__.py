"""Time series: speed, order-tracked averages, alignment, filters."""
