"""The page of the stress under a sphere."""
