"""Values by their keys."""

from compgen.core.unique_rows import grouped


def test_values_stand_at_their_keys_in_the_order_in_which_both_come():
    groups = grouped([("b", 1), ("a", 2), ("b", 0), ("a", 2)])
    assert list(groups.items()) == [("b", [1, 0]), ("a", [2, 2])]
    assert grouped([]) == {}
