"""Transfer functions of paper 003 and their identification."""
