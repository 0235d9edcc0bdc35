"""Replays beside measurements: figures of merit and the baselines that a model must beat."""
