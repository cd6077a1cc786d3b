"""What is wrong with recordings themselves, before any physics is blamed for it."""
