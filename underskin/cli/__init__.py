"""The command `underskin`."""
