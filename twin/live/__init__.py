"""The process beside the machine: blocks of load records in, a correction that never jumps out."""
