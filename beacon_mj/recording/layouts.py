"""The layouts that arrange a log in Foxglove and in Lichtblick; files of the wheel."""

from pathlib import Path

from beacon_mj.errors import LogError
from beacon_mj.files import replacing

ROOT = Path(__file__).parent / "layout_files"
VIEWERS = ("foxglove", "lichtblick")


def write_layouts(folder: Path) -> list[Path]:
    """Write both layouts to a folder, made when missing; return their paths.

    Raises:
        LogError: If a file is there that differs, or the folder cannot be written.
    """
    out = []
    for viewer in VIEWERS:
        path = folder / f"beacon-mj.{viewer}.json"
        layout = (ROOT / f"{viewer}.json").read_bytes()
        try:
            if path.exists() and path.read_bytes() != layout:
                raise LogError(f"{path}: expected no file but one is there; it stays.")
        except OSError as error:
            raise LogError(f"{path}: cannot read: {error.strerror}.") from error
        with replacing(path, LogError) as part:
            part.write_bytes(layout)
        out.append(path)
    return out
