"""The pages of a diagnosis and of the next experiment."""
