"""LabelVolume or mesh file to M_i: one closed, manifold, outward surface."""

from drkid.surface.extract import extract_surface

__all__ = ["extract_surface"]
