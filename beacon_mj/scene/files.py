"""Scene files: strict JSON with a published schema."""

from pathlib import Path
from typing import Any

import msgspec

from beacon_mj.errors import SceneError
from beacon_mj.regular_files import read_regular
from beacon_mj.scene import Scene
from beacon_mj.scene.checks import MAX_BYTES, Versioned, check_scene
from beacon_mj.scene.recertify import recertified


def scene_schema() -> dict[str, Any]:
    """Return the published JSON Schema of a scene file."""
    return msgspec.json.schema(Scene)


def parse_scene(data: bytes, source: str = "scene") -> Scene:
    """Decode and check a scene.

    Args:
        data: JSON text.
        source: Name of the file or object, for messages.

    Raises:
        SceneError: If the JSON is broken, a field is missing, unknown or out of
            range, or the scene fails `check_scene`.
    """
    try:
        msgspec.json.decode(data, type=Versioned)
        scene = msgspec.json.decode(data, type=Scene)
    except msgspec.ValidationError as error:
        raise SceneError(f"{source}: not a valid scene: {error}") from error
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise SceneError(f"{source}: not valid JSON: {error}") from error
    try:
        check_scene(scene)
    except SceneError as error:
        raise SceneError(f"{source}: {error}") from error
    return scene


def load_scene(path: str | Path) -> Scene:
    """Read a scene file; its certificate is proved again, see `recertified`.

    Raises:
        SceneError: On anything that is not a valid scene, or of which nothing can be
            proved.
    """
    path = Path(path)
    try:
        data = read_regular(path, MAX_BYTES)
    except OSError as error:
        raise SceneError(
            f"{path}: cannot read the scene file: {error.strerror}"
        ) from error
    scene = parse_scene(data, str(path))
    try:
        return recertified(scene)
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from error
