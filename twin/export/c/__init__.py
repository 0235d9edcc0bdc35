"""The runtime as C: one C99 file and its header."""
