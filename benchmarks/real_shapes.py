"""The real shapes that benchmarks run on: a folder of open data, which the repository may not hold."""

import os
import sys
from pathlib import Path

DATA = Path(os.environ.get("DRKID_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
LABELS = {"cells3d_nuclei_labels.ome.tif": 12}


def require_data() -> Path:
    """The folder, or the end of the program with a sentence that says what to do."""
    if not DATA.is_dir():
        sys.exit(f"no real shapes at {DATA}: set DRKID_DATA to their folder")
    return DATA
