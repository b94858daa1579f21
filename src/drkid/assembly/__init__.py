"""Pieces at their places, the joints between them, and an order in which to build."""

from drkid.assembly.assemble import assemble

__all__ = ["assemble"]
