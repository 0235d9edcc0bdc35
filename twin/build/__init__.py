"""Offline: full model, reduction, certificate."""
