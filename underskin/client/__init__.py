"""A client of the service: columns of numbers in, columns of numbers out."""
