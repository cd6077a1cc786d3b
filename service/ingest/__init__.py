"""From uploaded files to what the store keeps."""
