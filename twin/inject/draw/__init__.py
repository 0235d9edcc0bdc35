"""Trials drawn by seed: place, kind, size, times, parameters of the machine, air and noise."""
