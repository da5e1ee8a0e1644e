"""Training of nets."""
