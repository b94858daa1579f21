"""Make a kit of the bundled nucleus in Python, write it, and print what is in it.

python examples/first_kit.py [FOLDER]
"""

import sys

import drkid


def main(folder: str = "first-kit", faces: int = 172, rounds: int | None = None) -> drkid.Kit:
    """Make and write the kit, in ten seconds or in so many rounds; a folder of an earlier kit is replaced."""
    kit = drkid.make_kit(spec=drkid.KitSpec(faces=faces, rounds=rounds))
    kit.write(folder, force=True)
    for part, shape in enumerate(kit.part_set.parts):
        lengths = "  ".join(f"{x:6.2f}" for x in kit.decomposition.class_lengths[shape.class_index])
        count = sum(piece.part == part for piece in kit.assembly.pieces)
        print(f"{count:4d} pieces of class {shape.class_index + 1}, {shape.handedness:<5}  sides {lengths} mm")
    print(f"largest error {kit.metrics.error_max_percent:.2g} % of the mean edge: {kit.decomposition.outcome.status}")
    return kit


if __name__ == "__main__":
    main(*sys.argv[1:])
