"""What requests and answers hold: pydantic models, and columns."""
