"""The tour of the pages, photographed from a server and a browser of its own."""
