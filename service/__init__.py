"""The HTTP service: answers from the tables through `underskin`. Thin: no physics here."""
