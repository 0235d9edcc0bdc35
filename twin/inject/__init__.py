"""Effects hidden in descriptions and logs, trials drawn by seed, truths kept; knows nothing of `diagnose`."""
