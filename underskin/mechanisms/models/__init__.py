"""The models that a set of mechanisms makes up: of FRFs, indentation and compression."""
