"""Missing members: bodies that follow a logged temperature or a heat with one time constant, and move the tool."""
