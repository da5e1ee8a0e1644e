"""Solves of many surfaces at once, on PyTorch tensors whose last axis is that of the surfaces."""
