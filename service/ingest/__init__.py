"""From uploaded files to stored campaigns."""
