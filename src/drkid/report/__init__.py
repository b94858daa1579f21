"""Kit → what people hold, read and look at: its documents, and its picture."""

from drkid.report.documents import make_documents
from drkid.report.kit_picture import draw_kit

__all__ = ["draw_kit", "make_documents"]
