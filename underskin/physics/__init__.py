"""Mechanics in SI units: skin, contacts, elastic layers, and the response of a sensor."""
