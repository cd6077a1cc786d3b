"""Unlisted laws: quantity acted on × axis × form, each a mechanism like any other."""
