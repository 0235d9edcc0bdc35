"""Pictures of results: temperatures, TCP error, distorted workspace, coloured surface. Needs no display."""
