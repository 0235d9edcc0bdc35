"""What a simulation gets wrong, named: evidence, causes, extension, gain."""
