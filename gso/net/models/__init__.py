"""The architectures of nets."""
