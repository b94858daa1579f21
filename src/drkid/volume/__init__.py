"""Files to LabelVolume."""

from drkid.volume.read import read_volume

__all__ = ["read_volume"]
