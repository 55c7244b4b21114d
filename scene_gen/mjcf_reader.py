"""Reading a template with PyMJCF, without leaving the template folders."""

import re
import warnings
from pathlib import Path, PurePosixPath
from typing import Any

from beacon_mj.errors import TemplateError
from beacon_mj.mjcf_templates import ROOT

_INCLUDE = re.compile(rb'<include\s+file\s*=\s*"([^"]*)"')
_FILE = re.compile(rb'<(?!include)\w+[^>]*?\sfile\s*=\s*"([^"]*)"')
_FOLDER = re.compile(rb'\s(?:meshdir|texturedir|assetdir)\s*=\s*"')


def element_error(path: Path, element: str, expected: str) -> TemplateError:
    """Return the error for a missing or unusable element of a template."""
    return TemplateError(f"{path}: expected {element} ({expected}) but found none.")


def read_mjcf(path: Path) -> Any:
    """Parse a family file, with its includes, into a PyMJCF element tree.

    An include such as `../obstacles/box.xml` is looked up in the family's own
    template folder first, then among the shipped templates, so that a family file
    can be copied alone.

    Raises:
        TemplateError: If a file is missing, leaves the template folder, or is no MJCF.
    """
    text = _read(path)
    folder = path.parent.parent if path.parent.name == "families" else path.parent
    includes = dict(_includes(text, path, folder))
    mjcf = _pymjcf()
    try:
        return mjcf.from_xml_string(
            text, model_dir=str(path.parent), assets=includes, escape_separators=False
        )
    except Exception as error:  # PyMJCF raises many kinds; all mean "no valid MJCF".
        lines = str(error).strip().splitlines() or [type(error).__name__]
        raise TemplateError(f"{path}: not valid MJCF: {lines[-1]}") from error


def _pymjcf() -> Any:
    """Import PyMJCF, which warns where there is no display."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            from dm_control import mjcf
    except ImportError as error:
        raise TemplateError(
            "Reading templates needs dm-control, which has no release for this Python "
            "(its dependency labmaze has none for 3.13). Use Python 3.11 or 3.12."
        ) from error
    return mjcf


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise TemplateError(
            f"{path}: cannot read the template: {error.strerror}"
        ) from error


def _includes(text: bytes, path: Path, folder: Path) -> list[tuple[str, bytes]]:
    """Return (name as written, content) of each include, checking all file names."""
    if _FOLDER.search(text):
        raise TemplateError(
            f"{path}: expected no meshdir, texturedir or assetdir in a template."
        )
    for match in _FILE.findall(text):
        _inside(match.decode(), path)
    found = []
    for match in _INCLUDE.findall(text):
        name = match.decode()
        relative = _inside(name, path)
        candidates = [folder / relative, ROOT / relative]
        source = next((c for c in candidates if c.is_file()), None)
        if source is None:
            raise TemplateError(
                f"{path}: include {name!r} found neither in {folder} nor among the "
                "shipped templates."
            )
        content = _read(source)
        found.append((name, content))
        found += _includes(content, source, folder)
    return found


def _inside(name: str, path: Path) -> Path:
    """Normalise a file name of a family; it may not leave the template folder."""
    parts: list[str] = ["families"]
    pure = PurePosixPath(name)
    for part in pure.parts:
        if part == ".." and parts:
            parts.pop()
        elif part != ".":
            parts.append(part)
    if pure.is_absolute() or ".." in parts or name.count("..") > 1:
        raise TemplateError(
            f"{path}: expected file {name!r} to stay inside the template folder."
        )
    return Path(*parts)
