"""The report: numbers, sentences, figures, page."""
