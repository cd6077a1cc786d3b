"""The command `underskin`."""

from underskin.cli.app import main

__all__ = ["main"]
