"""Jobs and results that do not change once they are made: who tries is told so, as of any other refusal."""

from typing import Any

from compgen.core.exceptions import FrozenError

RESULT = "a result", "make another one"


def seal(owner: type[object], what: str, mend: str) -> None:
    """Let setting or deleting an attribute of a frozen dataclass raise FrozenError, an InputError.

    Args:
        owner: The class.
        what: It is, with its article.
        mend: What to do instead.
    """

    def refuse(self: Any, name: str, *value: object) -> None:
        raise FrozenError(f"{type(self).__name__}.{name}: {what} does not change; {mend}")

    owner.__setattr__ = owner.__delattr__ = refuse  # type: ignore[method-assign]
