"""Run folders: measured and simulated data in one shape."""
