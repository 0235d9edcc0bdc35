"""Matrices that other programs assembled: read, tested, reduced and certified as a machine of parts is."""
