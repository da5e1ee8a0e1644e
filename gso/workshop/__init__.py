"""From a design to the cutter: parts, their drawings, sheets, and a certificate."""

from __future__ import annotations
