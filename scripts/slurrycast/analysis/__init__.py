"""What is measured on one structure, or between two."""
