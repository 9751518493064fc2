"""The version of compgen: what ``pyproject.toml`` says too, in every record and on every page."""

__version__ = "0.1.0"
