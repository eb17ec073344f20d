"""Measures of one structure, or of two that are compared."""
