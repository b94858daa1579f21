"""Kit → the kit folder: kit.json, surfaces, STL parts and parts list."""

from drkid.export.document import KitDocument
from drkid.export.folder import require_writable, write_kit

__all__ = ["KitDocument", "require_writable", "write_kit"]
