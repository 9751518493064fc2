"""Results that do not change once they are made: who tries is told so, in the words of any other refusal."""

from typing import Any, TypeVar

from compgen.core.exceptions import FrozenError

T = TypeVar("T")


def sealed(owner: type[T]) -> type[T]:
    """Let setting or deleting an attribute of a frozen dataclass raise FrozenError, an InputError."""

    def refuse(self: Any, name: str, *value: object) -> None:
        raise FrozenError(f"{type(self).__name__}.{name}: a result does not change; make another one")

    owner.__setattr__ = owner.__delattr__ = refuse  # type: ignore[method-assign]
    return owner
