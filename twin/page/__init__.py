"""The page of a result or of a running machine: its content as JSON, and the front end that draws it."""
