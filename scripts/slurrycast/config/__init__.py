"""What a run may ask for: every check of the configuration."""
