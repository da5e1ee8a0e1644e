"""Surfaces to train and to compare on."""
