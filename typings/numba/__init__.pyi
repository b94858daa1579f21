from collections.abc import Callable
from typing import Any, TypeVar, overload

F = TypeVar("F", bound=Callable[..., Any])

@overload
def njit(function: F) -> F: ...
@overload
def njit(
    *,
    cache: bool = ...,
    fastmath: bool | set[str] = ...,
    parallel: bool = ...,
    nogil: bool = ...,
    inline: str = ...,
    _nrt: bool = ...,
) -> Callable[[F], F]: ...

prange = range
