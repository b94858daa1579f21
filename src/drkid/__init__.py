"""Turn an organic 3D shape into a construction kit whose pieces come in very few identical shapes.

```python
import drkid

kit = drkid.make_kit("mitochondrion.nii.gz", drkid.KitSpec(faces=172))
kit.write("mitochondrion-kit")
```
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from drkid.errors import DrkidError
    from drkid.kit import Kit
    from drkid.pipeline import make_kit
    from drkid.spec import UNIVERSAL, KitSpec

__version__ = "0.1.0"
__all__ = ["UNIVERSAL", "DrkidError", "Kit", "KitSpec", "__version__", "make_kit"]

_HOMES = {"DrkidError": "errors", "Kit": "kit", "KitSpec": "spec", "UNIVERSAL": "spec", "make_kit": "pipeline"}


def __getattr__(name: str) -> Any:
    """Import what is asked for only then: `drkid --help` must not wait for numerical libraries."""
    if name not in _HOMES:
        message = f"module 'drkid' has no attribute {name!r}"
        raise AttributeError(message)
    from importlib import import_module  # noqa: PLC0415

    return getattr(import_module(f"drkid.{_HOMES[name]}"), name)
