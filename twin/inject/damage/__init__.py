"""Faults of logs: what sensors, signals, clocks and measurements of the tool get wrong."""
