"""Classes of triangles to curved patches, or to pieces that are merged of several triangles."""

from drkid.patches.curved import flattened_patches
from drkid.patches.make import make_patches

__all__ = ["flattened_patches", "make_patches"]
