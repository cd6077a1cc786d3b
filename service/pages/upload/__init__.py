"""The pages of an upload."""
