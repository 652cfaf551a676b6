"""Pages from records: reads JSON data, and nothing else of the package."""
