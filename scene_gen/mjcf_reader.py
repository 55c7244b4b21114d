"""Reading a template with PyMJCF, without leaving the template folders."""

import hashlib
import warnings
import xml.etree.ElementTree as ET
from pathlib import Path, PurePosixPath
from typing import Any

from beacon_mj.errors import TemplateError
from beacon_mj.mjcf_templates import ROOT

_FOLDERS = ("meshdir", "texturedir", "assetdir")


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
    assets = dict(_files(text, path, _folder(path)))
    mjcf = _pymjcf()
    try:
        return mjcf.from_xml_string(
            text, model_dir=str(path.parent), assets=assets, escape_separators=False
        )
    except Exception as error:  # PyMJCF raises many kinds; all mean "no valid MJCF".
        lines = str(error).strip().splitlines() or [type(error).__name__]
        raise TemplateError(f"{path}: not valid MJCF: {lines[-1]}") from error


def template_sha256(path: Path) -> str:
    """Return the SHA-256 of a family file and all that it refers to, unparsed.

    Raises:
        TemplateError: If a file is missing, leaves the template folder, or is no XML.
    """
    text = _read(path)
    parts = [text]
    for name, content in _files(text, path, _folder(path)):
        parts += [name.encode(), content]
    # Of their digests, so that no two lists of parts read the same.
    digests = b"".join(hashlib.sha256(part).digest() for part in parts)
    return hashlib.sha256(digests).hexdigest()


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


def _folder(path: Path) -> Path:
    """Return the template folder that a family file belongs to."""
    return path.parent.parent if path.parent.name == "families" else path.parent


def _files(
    text: bytes, path: Path, folder: Path, trail: tuple[Path, ...] = ()
) -> list[tuple[str, bytes]]:
    """Return (name as written, content) of every file that a template refers to."""
    if path in trail:
        raise TemplateError(f"{path}: expected no file to include itself.")
    found = []
    for element in _parse(text, path).iter():
        if any(name in element.attrib for name in _FOLDERS):
            raise TemplateError(
                f"{path}: expected no meshdir, texturedir or assetdir in a template."
            )
        for name in _file_names(element):
            source = _find(name, path, folder)
            content = _read(source)
            found.append((name, content))
            if element.tag == "include":
                found += _files(content, source, folder, (*trail, path))
    return found


def _parse(text: bytes, path: Path) -> ET.Element:
    """Parse a template without following anything that it refers to."""
    if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
        raise TemplateError(f"{path}: expected no document type or entities.")
    try:
        return ET.fromstring(text)
    except ET.ParseError as error:
        raise TemplateError(f"{path}: not valid XML: {error}") from error


def _file_names(element: ET.Element) -> list[str]:
    """Return the file names that an element refers to, such as `fileright`."""
    return [v for k, v in element.attrib.items() if k.startswith("file")]


def _find(name: str, path: Path, folder: Path) -> Path:
    """Return where a file is: beside the template that names it, or as an include."""
    relative = _inside(name, path)
    homes = folder.resolve(), ROOT.resolve()
    for candidate in (path.parent / name, folder / relative, ROOT / relative):
        real = candidate.resolve()
        if candidate.is_file() and any(real.is_relative_to(home) for home in homes):
            return candidate
    raise TemplateError(
        f"{path}: file {name!r} found neither in {folder} nor among the shipped "
        "templates."
    )


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
