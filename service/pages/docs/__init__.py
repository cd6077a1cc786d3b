"""The documentation on the server."""
