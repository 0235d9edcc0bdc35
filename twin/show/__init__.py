"""A machine as it is described, before anything is built: its surfaces, and what acts where, as a page."""
