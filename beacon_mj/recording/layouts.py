"""The layouts that arrange a log in Foxglove and in Lichtblick; files of the wheel."""

from pathlib import Path

from beacon_mj.errors import LogError

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
            folder.mkdir(parents=True, exist_ok=True)
            if path.exists() and path.read_bytes() != layout:
                raise LogError(f"{path}: expected no file but one is there; it stays.")
            path.write_bytes(layout)
        except OSError as error:
            raise LogError(f"{path}: cannot write: {error.strerror}.") from error
        out.append(path)
    return out
