"""What may be wrong with a simulation: candidates, responses and exact terms of every family."""
