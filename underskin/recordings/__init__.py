"""What a lab records, in the formats its instruments write, as one campaign model."""
