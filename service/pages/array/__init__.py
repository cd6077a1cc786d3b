"""The pages of an array under loads or under a map of pressure."""
