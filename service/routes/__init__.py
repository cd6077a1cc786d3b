"""HTTP: parse the request, call a use case, shape the answer."""
