"""The search for seams along which a design can be cut into pieces that can be laid flat."""

from gso.segmentation.found import Segmentation
from gso.segmentation.search import pieces
from gso.segmentation.sheets import Sheet

__all__ = ["Segmentation", "Sheet", "pieces"]
