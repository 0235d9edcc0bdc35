"""Another machine than the described one, and what it does in the runs: reduced for hundreds of trials, or in full."""
