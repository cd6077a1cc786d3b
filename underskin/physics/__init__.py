"""The mechanics, in SI: contacts, layers, and what reaches a sensor."""
