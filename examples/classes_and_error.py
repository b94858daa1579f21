"""How many classes does a shape need with the paper's solver? The largest error and the moulds for a few k.

python examples/classes_and_error.py
"""

from collections.abc import Iterable

import drkid


def main(classes: Iterable[int] = (2, 4, 7, 10), faces: int = 172, iterations: int = 5000) -> list[drkid.Kit]:
    """Make a kit for each k and print one line about it."""
    print(f"{'k':>3}{'moulds':>8}{'largest error %':>17}{'mean error %':>14}{'distance mean / max %':>24}  outcome")
    kits: list[drkid.Kit] = []
    for k in classes:
        spec = drkid.KitSpec(method="pressure", faces=faces, classes=k, max_iterations=iterations)
        kit = drkid.make_kit(spec=spec)
        m = kit.metrics
        distance = f"{m.surface_assembled.mean_percent:.2f} / {m.surface_assembled.max_percent:.2f}"
        print(
            f"{k:>3}{m.unique_piece_parts:>8}{m.error_max_percent:>17.2f}{m.error_mean_percent:>14.2f}{distance:>24}"
            f"  {kit.decomposition.outcome.status}"
        )
        kits.append(kit)
    return kits


if __name__ == "__main__":
    main()
