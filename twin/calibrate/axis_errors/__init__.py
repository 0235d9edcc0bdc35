"""Single axis errors (ISO 230-1) and the R-tests that show them."""
