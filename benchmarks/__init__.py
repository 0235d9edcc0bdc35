"""What is claimed about accuracy, speed and memory, as commands: `python -m benchmarks [NAME ...]`."""
