"""From scores to a verdict: detector, selection, exact refinement, stop rules, the sealed runs."""
