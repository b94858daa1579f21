"""Kit → what people hold, read and look at."""

from drkid.report.documents import make_documents

__all__ = ["make_documents"]
