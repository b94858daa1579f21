from string import ascii_uppercase, digits

import numpy as np
import pytest

from drkid.parts.stroke_font import strokes


@pytest.mark.parametrize("letter", ascii_uppercase + digits)
def test_letters_are_as_tall_as_asked_and_centred(letter) -> None:
    lines = strokes(letter, 3.0)
    assert np.ptp(lines[..., 1]) == pytest.approx(3.0)
    assert np.abs(lines[..., 0]).max() <= 1.0 + 1e-12
    assert (np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1) > 0).all()


def test_letters_differ_and_words_are_wider() -> None:
    assert len({strokes(c, 1.0).tobytes() for c in ascii_uppercase + digits}) == 36
    assert np.ptp(strokes("AB", 3.0)[..., 0]) > 1.9 * np.ptp(strokes("A", 3.0)[..., 0])
    with pytest.raises(KeyError):
        strokes("a", 1.0)
