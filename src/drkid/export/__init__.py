"""Kit → the kit folder: kit.json, surfaces, STL parts and parts list."""

from drkid.export.document import KitDocument
from drkid.export.folder import require_writable, write_kit
from drkid.export.kit_document import kit_costs, kit_summary

__all__ = ["KitDocument", "kit_costs", "kit_summary", "require_writable", "write_kit"]
