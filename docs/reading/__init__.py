"""The annotated picture of docs/diagnosis.md."""
