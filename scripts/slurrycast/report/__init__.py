"""Figures and pages for people. Nothing else imports from here."""
