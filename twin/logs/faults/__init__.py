"""Faults of measured channels: sensors that break, leap or stand still, probes that are re-zeroed, spliced logs."""
