"""What the service answers, as typed documents; `python -m scripts.client_documents` writes all but `document`."""
