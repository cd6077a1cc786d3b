"""Errors in the recordings themselves, checked before any physics is fitted."""
