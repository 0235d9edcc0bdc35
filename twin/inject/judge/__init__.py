"""Whether answers agree with what was hidden, and the figures of a campaign: compares plain dictionaries."""
