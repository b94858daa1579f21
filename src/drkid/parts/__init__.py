"""Classes to solids: thickening, bevels, pockets and connectors, at a scale at which they fit."""

from drkid.parts.make import make_parts

__all__ = ["make_parts"]
