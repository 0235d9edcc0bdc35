"""Learning from measurements: scores, baselines, parameters fitted to runs, updates on the machine."""
