"""Stroke font: capital letters and digits of few straight strokes, for engraving."""

import numpy as np

from drkid.mesh import Floats

CELL = (4.0, 6.0)  # width and height of the grid that letters are drawn on
GAP = 2.0  # between one letter and the next, on the grid

_GLYPHS = {  # polylines of grid points, a digit for x and one for y
    "A": "00 04 26 44 40, 02 42",
    "B": "00 06 36 45 44 33 03, 33 42 41 30 00",
    "C": "41 30 10 01 05 16 36 45",
    "D": "00 06 26 44 42 20 00",
    "E": "40 00 06 46, 03 33",
    "F": "00 06 46, 03 33",
    "G": "45 36 16 05 01 10 30 41 43 23",
    "H": "00 06, 40 46, 03 43",
    "I": "20 26, 10 30, 16 36",
    "J": "01 10 30 41 46",
    "K": "00 06, 46 03 40",
    "L": "06 00 40",
    "M": "00 06 23 46 40",
    "N": "00 06 40 46",
    "O": "10 01 05 16 36 45 41 30 10",
    "P": "00 06 36 45 44 33 03",
    "Q": "10 01 05 16 36 45 41 30 10, 22 40",
    "R": "00 06 36 45 44 33 03, 23 40",
    "S": "01 10 30 41 42 33 13 04 05 16 36 45",
    "T": "20 26, 06 46",
    "U": "06 01 10 30 41 46",
    "V": "06 20 46",
    "W": "06 10 23 30 46",
    "X": "00 46, 06 40",
    "Y": "06 23 46, 23 20",
    "Z": "06 46 00 40",
    "0": "10 01 05 16 36 45 41 30 10, 01 45",
    "1": "05 26 20, 10 30",
    "2": "05 16 36 45 44 00 40",
    "3": "05 16 36 45 44 33 42 41 30 10 01, 13 33",
    "4": "40 46 02 42",
    "5": "46 06 03 33 42 41 30 00",
    "6": "45 36 16 05 01 10 30 41 42 33 03",
    "7": "06 46 10",
    "8": "13 04 05 16 36 45 44 33 13 02 01 10 30 41 42 33",
    "9": "01 10 30 41 45 36 16 05 04 13 43",
}


def strokes(text: str, height: float, least_gap: float = 0.0) -> Floats:
    """(n, 2, 2): the ends of the strokes of letters and digits, `height` tall without the strokes' width, centred at 0.

    Letters are `least_gap` apart at least.

    Raises:
        KeyError: a character is neither a capital letter nor a digit.
    """
    advance = CELL[0] + max(GAP, least_gap * CELL[1] / height)
    found: list[Floats] = []
    for place, letter in enumerate(text):
        for line in _GLYPHS[letter].split(","):
            points = np.array([[int(c) for c in point] for point in line.split()], np.float64)
            points[:, 0] += place * advance
            found.append(np.stack([points[:-1], points[1:]], axis=1))
    lines = np.concatenate(found)
    middle = np.array([(len(text) - 1) * advance + CELL[0], CELL[1]]) / 2
    return (lines - middle) * height / CELL[1]
