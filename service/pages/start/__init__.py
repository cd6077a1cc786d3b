"""The start page, the example skin, and logging in."""
