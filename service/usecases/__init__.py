"""What a request means: called by routes and pages alike."""
