"""MuJoCo's hooks."""

from collections.abc import Callable

def set_mju_user_warning(callback: Callable[[str], object] | None, /) -> None: ...
