"""Application of nets to surfaces."""
