"""How a stage tells how far it is: a callback, silent by default."""

from collections.abc import Callable

Progress = Callable[[str, float], None]
"""Called with what is being done, in a few words, and the fraction of the stage that is done, in [0, 1]."""


def silent(_what: str, _fraction: float) -> None:
    """Tell nobody."""
