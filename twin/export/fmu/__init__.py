"""The runtime as a Functional Mock-up Unit."""
