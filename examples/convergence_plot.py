"""Plot how the solver converges, from a written kit.json (needs matplotlib: the extra `figures`).

The paper's solver (`drkid make --method pressure`) has the longer way: the palette solver is often exact at once.

python examples/convergence_plot.py KIT [PICTURE]
"""

import json
import sys
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt


def main(kit: str, picture: str = "convergence.png") -> Path:
    """Draw largest and mean error over the iterations that kit.json records; the picture's path."""
    mpl.use("Agg")
    document = json.loads((Path(kit) / "kit.json").read_text())
    records = document["convergence"]
    figure, axis = plt.subplots(layout="constrained")
    for name in ("error_max_percent", "error_mean_percent"):
        axis.semilogy([r["iteration"] for r in records], [r[name] for r in records], label=name)
    axis.axhline(document["spec"]["tolerance_percent"], color="0.5", linestyle="--", label="tolerance_percent")
    axis.set(xlabel="iteration or round", ylabel="% of the mean edge", title=document["outcome"]["message"])
    axis.legend()
    figure.savefig(picture)
    plt.close(figure)
    return Path(picture)


if __name__ == "__main__":
    main(*sys.argv[1:])
