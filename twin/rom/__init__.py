"""The reduced model and its file."""
