from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drkid.congruence.palette import LETTERS, Palette, all_multisets, palette_of_classes, parse_multisets
from drkid.errors import SpecError

CLASSES = (1, 2, 3, 4, 10)
BAD_WORDS = ["", " , ", "sl", "ssll", "sls,ab", "sal", "abd", "ssl;sll", "ss1", "ssl,abc"]


@pytest.mark.parametrize("classes", CLASSES)
def test_a_palette_has_as_many_multisets_as_classes(classes):
    palette = palette_of_classes(classes)
    assert len(set(palette.multisets)) == classes
    assert palette.size == (3 if classes == 10 else 2)
    assert palette.ratios[0] == 1
    assert list(palette.ratios) == sorted(set(palette.ratios))
    assert all(tuple(sorted(m)) == m and max(m) < palette.size for m in palette.multisets)


@pytest.mark.parametrize("classes", [0, 5, 9, 11, -1])
def test_other_numbers_of_classes_are_refused(classes):
    with pytest.raises(SpecError) as caught:
        palette_of_classes(classes)
    assert caught.value.found == str(classes)
    assert caught.value.remedy


@pytest.mark.parametrize("text", BAD_WORDS)
def test_words_that_are_no_multisets_are_refused(text):
    with pytest.raises(SpecError) as caught:
        parse_multisets(text)
    assert caught.value.found == text
    assert "three letters" in caught.value.wanted


def test_every_order_of_an_allowed_multiset_is_allowed_and_no_other():
    palette = parse_multisets("aab,abc,bcc")
    for labels in product(range(3), repeat=3):
        assert palette.allowed[labels] == (tuple(sorted(labels)) in palette.multisets)
    assert palette.allowed.sum() == 3 + 6 + 3


def test_the_table_of_allowed_labels_is_read_only():
    with pytest.raises(ValueError, match="read-only"):
        palette_of_classes(2).allowed[0, 0, 0] = True


@pytest.mark.parametrize("classes", CLASSES)
def test_reading_back_the_letters_gives_the_same_palette(classes):
    palette = palette_of_classes(classes)
    letters = LETTERS[palette.size]
    words = ["".join(letters[i] for i in m) for m in palette.multisets]
    assert parse_multisets(",".join(words)) == palette
    assert parse_multisets(" , ".join(w[::-1].upper() for w in reversed(words + words))) == palette


@pytest.mark.parametrize("size", [1, 2, 3, 4])
def test_there_are_q_plus_2_over_3_multisets(size):
    assert len(set(all_multisets(size))) == size * (size + 1) * (size + 2) // 6
    assert Palette(tuple(range(1, size + 1)), all_multisets(size)).allowed.all()


@given(st.floats(0.01, 100), st.integers(0, 1000), st.sampled_from(CLASSES))
def test_lengths_have_the_ratios_and_the_mean(mean, seed, classes):
    palette = palette_of_classes(classes)
    labels = np.random.default_rng(seed).integers(palette.size, size=50)
    lengths = palette.lengths(mean, labels)
    assert lengths[labels].mean() == pytest.approx(mean)
    np.testing.assert_allclose(lengths / lengths[0], palette.ratios)


def test_class_of_a_face_is_the_place_of_its_multiset_in_any_order():
    palette = palette_of_classes(2)
    for number, multiset in enumerate(palette.multisets):
        orders = np.array(list(permutations(multiset)))
        assert (palette.class_of(orders) == number).all()
    assert palette.class_of(np.array([[0, 0, 0], [1, 1, 1]])).tolist() == [-1, -1]
