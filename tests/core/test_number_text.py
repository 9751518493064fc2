import pytest

from compgen.core.number_text import beyond_text


@pytest.mark.parametrize(
    ("value", "limit", "text"),
    [(4.585, 2.5, "4.58"), (2.5004, 2.5, "2.5004"), (2.504, 2.503, "2.504"), (2.5, 2.5, "2.50"), (0.9999, 1, "0.9999")],
)
def test_a_value_shows_on_which_side_of_its_limit_it_is(value, limit, text):
    assert beyond_text(value, limit) == text


def test_the_last_bit_of_a_number_is_shown_where_it_decides():
    assert float(beyond_text(2.5000000000000004, 2.5)) > 2.5
