"""The experiments of docs/reproduced.md: each shows what its page says of it."""

import reproduced


def test_the_hierarchical_method_changes_less_than_the_cascade_and_agrees_with_it() -> None:
    """Twelve problems of 20 unknowns."""
    (line,) = reproduced.profile((20,), 12)
    assert line[0] == "20"
    assert int(line[1]) < int(line[2])
    assert float(line[-1]) < 1e-9


def test_saturation_lies_between_plain_scaling_and_the_largest_factor() -> None:
    """For each demand; a larger one is met by a smaller share."""
    lines = [*reproduced.scale_factors(24)]
    for _, _, own, most, plain, _ in lines:
        assert float(plain) <= float(own) <= float(most) + 1e-9
    means = [float(line[2]) for line in lines]
    assert means == sorted(means, reverse=True)


def test_near_a_conflict_only_the_pseudo_inverse_grows_without_bound() -> None:
    """Its largest entry is about 1/gap; that of singularity-robust priority stays below 1."""
    for line in reproduced.near_a_conflict((1e-2, 1e-4)):
        gap = float(line[0])
        pinv, robust = (float(cell.partition(" ")[0]) for cell in (line[1], line[3]))
        assert 0.9 / gap < pinv < 1.1 / gap
        assert robust < 1.0
