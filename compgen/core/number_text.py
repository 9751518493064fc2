"""Numbers in messages."""

MOST_DECIMALS = 12


def beyond_text(value: float, limit: float, decimals: int = 2) -> str:
    """A value with as many decimals as show on which side of a limit it is: 2.5004, not 2.50, beyond 2.5.

    Args:
        value: In the unit of the message.
        limit: In the same.
        decimals: As many at least.
    """
    for places in range(decimals, MOST_DECIMALS):
        text = f"{value:.{places}f}"
        if (float(text) > limit) == (value > limit) and (float(text) < limit) == (value < limit):
            return text
    return f"{value!r}"
