"""Machines drawn from a seed: descriptions, loads of their runs, and the real machines that differ from them."""
