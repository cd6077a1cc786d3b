"""`python -m underskin`, where the command is not on the path."""

from underskin.cli import main

main()
