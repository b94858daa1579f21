"""M_s → Decomposition: the classes of congruent triangles and the mesh M_f that they make."""

from drkid.congruence.decompose import decompose

__all__ = ["decompose"]
