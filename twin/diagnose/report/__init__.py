"""The report: words, tables, pictures, page."""
