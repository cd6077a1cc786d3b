"""What several pages use: templates, forms, figures, verdicts."""
