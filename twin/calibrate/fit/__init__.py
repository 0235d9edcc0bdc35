"""Parameters fitted to measured runs: the window model, the least squares problem, what data can separate."""
