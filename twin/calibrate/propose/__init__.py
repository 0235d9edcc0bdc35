"""From a log to a machine: columns understood, a run folder, a network, and how well it predicts."""
