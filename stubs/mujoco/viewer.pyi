"""MuJoCo's interactive viewer."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from types import TracebackType

from mujoco._structs import MjData, MjModel, MjvCamera, MjvScene

_Text = tuple[int | None, int | None, str | None, str | None]

class Handle:
    @property
    def cam(self) -> MjvCamera: ...
    @property
    def user_scn(self) -> MjvScene: ...
    def __enter__(self) -> Handle: ...
    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...
    def is_running(self) -> bool: ...
    def lock(self) -> AbstractContextManager[object]: ...
    def set_texts(self, texts: _Text | list[_Text]) -> None: ...
    def sync(self, state_only: bool = False) -> None: ...

def launch(
    model: MjModel | None = None,
    data: MjData | None = None,
    *,
    show_left_ui: bool = True,
    show_right_ui: bool = True,
) -> None: ...
def launch_passive(
    model: MjModel,
    data: MjData,
    *,
    key_callback: Callable[[int], None] | None = None,
    show_left_ui: bool = True,
    show_right_ui: bool = True,
) -> Handle: ...
