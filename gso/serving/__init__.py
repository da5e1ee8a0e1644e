"""A server for other programs: requests and answers as lines of JSON (``gso serve --stdio``).

``docs/hosts.rst`` describes the protocol.
"""

from gso.serving.protocol import PROTOCOL
from gso.serving.server import Server

__all__ = ["PROTOCOL", "Server"]
