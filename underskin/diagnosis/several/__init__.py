"""Several campaigns of one skin, or skins of one make, diagnosed together."""
