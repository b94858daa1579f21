"""M_i to M_s: few, even triangles."""

from drkid.remesh.simplify import simplify

__all__ = ["simplify"]
