"""The page of fleets: skins of one make."""
