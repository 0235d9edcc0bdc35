"""What others may read of a result or of a running machine: HTTP with a page, and OPC UA."""
