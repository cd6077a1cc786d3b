"""`python -m underskin`, where the command is not on the path."""

from underskin.cli.app import main

main()
