"""Temperature channels against each other: each is predicted from all others, and one that they refute is set aside."""
