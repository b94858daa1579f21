from dataclasses import replace

import numpy as np
import pytest

from drkid.congruence.framework import Framework
from drkid.congruence.hop import Anneal, Problem, annealed
from drkid.congruence.labelling import first_labels, matched_labels
from drkid.congruence.levenberg_marquardt import solve
from drkid.congruence.palette import Palette, all_multisets, moulds, palette_of_classes, parse_multisets
from drkid.congruence.palette_subset import Trials, best_subset, palette_for
from drkid.congruence.target import Target
from drkid.errors import SpecError

TEN = palette_of_classes(10)


@pytest.fixture(scope="module")
def five(pebble) -> Palette:
    return palette_for(pebble, 5, np.random.default_rng(0))


def is_allowed(mesh, palette, labels) -> bool:
    return bool(palette.allowed[tuple(labels[mesh.face_edges].T)].all())


def lengths_of(palette, mesh):
    return np.array(palette.ratios) * mesh.mean_edge / np.mean(palette.ratios)


def misfit(mesh, labels, lengths) -> float:
    return float(((mesh.edge_lengths - lengths[labels]) ** 2).sum())


# ---- every number of classes


@pytest.mark.parametrize("classes", [1, 2, 3, 4, 10])
def test_small_numbers_of_classes_and_ten_have_a_fixed_palette(pebble, classes):
    assert palette_for(pebble, classes, np.random.default_rng(0)) == palette_of_classes(classes)


@pytest.mark.parametrize("classes", [6, 8, 9])
def test_between_as_many_multisets_as_asked_are_chosen(pebble, classes):
    palette = palette_for(pebble, classes, np.random.default_rng(1))
    assert palette.ratios == TEN.ratios
    assert len(palette.multisets) == classes
    assert list(palette.multisets) == sorted(set(palette.multisets) & set(TEN.multisets))


@pytest.mark.parametrize("classes", [-1, 0, 11, 40])
def test_more_than_ten_classes_or_none_are_refused(pebble, classes):
    with pytest.raises(SpecError, match="no palette") as caught:
        palette_for(pebble, classes, np.random.default_rng(0))
    assert caught.value.found == str(classes)
    assert "10" in caught.value.wanted


@pytest.mark.parametrize("classes", [0, 3])
def test_no_more_can_be_chosen_than_there_are(pebble, classes):
    with pytest.raises(SpecError, match="cannot be chosen"):
        best_subset(pebble, palette_of_classes(2), classes, np.random.default_rng(0))


def test_all_of_a_palette_is_the_palette(pebble):
    assert best_subset(pebble, TEN, 10, np.random.default_rng(0)) == TEN


# ---- the search


def test_place_and_unit_of_the_mesh_do_not_matter(pebble, five):
    """A power of two scales without rounding, so that every random decision is the same."""
    other = palette_for(pebble.scaled(2.0**7), 5, np.random.default_rng(0))
    assert other == five


def test_the_choice_is_better_than_chance(pebble, five):
    """Annealed in the same way with other random numbers, it leaves less misfit than most sets drawn blindly."""
    unit = pebble.scaled(1 / pebble.mean_edge)
    rng, target = np.random.default_rng(7), Target(unit)

    def merit(palette) -> float:
        lengths = lengths_of(palette, unit)
        frame = Framework(unit, first_labels(unit, palette, lengths, np.random.default_rng(5)), lengths)
        problem = Problem(target, palette, "scale", square=False)
        soft = annealed(frame, problem, Anneal(0.4, 0.05, 3.0, 20_000), np.random.default_rng(5))
        return solve(soft, target, 0.4, "scale", 3)[1]

    drawn = [sorted(rng.choice(10, 5, replace=False).tolist()) for _ in range(7)]
    by_chance = [merit(replace(TEN, multisets=tuple(TEN.multisets[i] for i in d))) for d in drawn]
    assert merit(five) < np.median(by_chance)


def test_every_chosen_multiset_is_used_after_annealing(pebble, five):
    unit = pebble.scaled(1 / pebble.mean_edge)
    uses = Trials(unit, Target(unit), TEN, 11).of(five.multisets)[1]
    assert len(uses) == 5
    assert min(uses) > 0


def test_a_set_without_labels_is_no_candidate(pebble):
    unit = pebble.scaled(1 / pebble.mean_edge)
    trials = Trials(unit, Target(unit), TEN, 0)
    scalene, some = ((0, 1, 2),), ((0, 0, 1), (0, 0, 2))
    assert trials.of(scalene)[0] == np.inf
    assert trials.best([scalene, some]) == some


# ---- first labels for any palette


@pytest.mark.parametrize("words", ["ssl", "sll", "ssl,sll", "sss,sll", "aab,bcc", "aaa,abc", "abb", "abc,abb,bcc"])
@pytest.mark.parametrize("name", ["pebble", "ring"])
def test_first_labels_are_allowed_whatever_the_palette(words, name, request):
    mesh, palette = request.getfixturevalue(name), parse_multisets(words)
    labels = first_labels(mesh, palette, lengths_of(palette, mesh), np.random.default_rng(0))
    assert labels.dtype == np.int64
    assert is_allowed(mesh, palette, labels)


def test_matched_labels_fit_better_than_any_repair(pebble):
    """They are the best: no labels that a matching with random weights gives miss the lengths less."""
    palette = palette_of_classes(1)
    lengths = lengths_of(palette, pebble)
    best = misfit(pebble, matched_labels(pebble, (0, 0, 1), lengths), lengths)
    rng = np.random.default_rng(0)
    for _ in range(20):
        noisy = pebble.moved(pebble.vertices + 0.05 * pebble.mean_edge * rng.normal(size=pebble.vertices.shape))
        labels = matched_labels(noisy, (0, 0, 1), lengths)
        assert is_allowed(pebble, palette, labels)
        assert best <= misfit(pebble, labels, lengths) + 1e-5


@pytest.mark.parametrize(("multiset", "odd"), [((0, 0, 1), 1), ((0, 1, 1), 0), ((1, 1, 2), 2), ((0, 2, 2), 0)])
def test_every_face_has_one_odd_edge(pebble, multiset, odd):
    lengths = np.array([0.9, 1.0, 1.15]) * pebble.mean_edge
    labels = matched_labels(pebble, multiset, lengths)
    assert ((labels[pebble.face_edges] == odd).sum(axis=1) == 1).all()
    assert set(np.unique(labels)) == set(multiset)


def test_a_palette_without_labels_is_refused(pebble):
    palette = parse_multisets("abc")
    with pytest.raises(SpecError, match="no labelling") as caught:
        first_labels(pebble, palette, lengths_of(palette, pebble), np.random.default_rng(0))
    assert caught.value.remedy


# ---- moulds


def test_scalene_triangles_need_two_moulds_and_others_one():
    assert moulds(parse_multisets("ssl,sll")) == 2
    assert moulds(parse_multisets("aab,abc")) == 3
    assert moulds(TEN) == 11
    four = Palette((1, 2, 3, 4), all_multisets(4))
    assert moulds(four) == len(all_multisets(4)) + 4  # as many scalene ones as ways to leave a length out


def test_a_single_class_of_two_lengths_has_its_own_ratio():
    assert palette_of_classes(1).ratios != palette_of_classes(2).ratios
    assert 1.1 <= palette_of_classes(1).ratios[1] <= 1.15
