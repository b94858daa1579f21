"""How a stage, or a run through several, tells how far it is: a callback, silent by default."""

from collections.abc import Callable

Progress = Callable[[str, float], None]
"""Called with what is being done, in a few words, and the fraction of the stage that is done, in [0, 1]."""


def silent(_what: str, _fraction: float) -> None:
    """Tell nobody."""


StageProgress = Callable[[str, str, float], None]
"""Called with the stage, what it is doing, and the fraction of the stage that is done."""


def nobody(_stage: str, _what: str, _fraction: float) -> None:
    """Tell nobody of any stage."""
