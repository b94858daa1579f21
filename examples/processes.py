"""The smallest kit that each manufacturing process can make: size, thickness, rod and material.

python examples/processes.py
"""

import drkid
from drkid.process import PROCESSES


def main(faces: int = 172, rounds: int = 20) -> dict[str, drkid.Kit]:
    """Make the nucleus for every process and print one line about each; equal rounds make equal triangles."""
    print(f"{'process':<12}{'longest side mm':>16}{'thickness mm':>14}{'rod mm':>8}{'pieces cm³':>12}{'pieces g':>10}")
    kits: dict[str, drkid.Kit] = {}
    for process in PROCESSES:
        kit = drkid.make_kit(spec=drkid.KitSpec(faces=faces, rounds=rounds, process=process))
        size = kit.part_set.dimensions
        volume = sum(kit.part_set.parts[piece.part].solid.volume for piece in kit.assembly.pieces) / 1000
        print(
            f"{process:<12}{kit.spec.size_mm:>16.0f}{size.thickness_mm:>14.1f}{size.rod_diameter_mm:>8g}{volume:>12.0f}"
            f"{volume * kit.spec.preset.density_g_cm3:>10.0f}"
        )
        kits[process] = kit
    return kits


if __name__ == "__main__":
    main()
