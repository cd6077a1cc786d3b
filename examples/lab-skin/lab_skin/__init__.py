"""What one lab adds to underskin: a mechanism, a file format, a command."""
