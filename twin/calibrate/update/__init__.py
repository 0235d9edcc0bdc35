"""Correction on the machine by sparse TCP measurements and by temperatures."""
