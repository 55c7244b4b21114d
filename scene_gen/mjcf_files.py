"""The files that a family is made of: found, parsed, put into one, and hashed.

Includes are put in place here, not by MuJoCo, because only so is it known which file
each element stands in, and which file each asset is.
"""

import functools
import hashlib
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from xml.parsers import expat

from beacon_mj.errors import TemplateError
from beacon_mj.mjcf_templates import ROOT
from beacon_mj.scene_gen.layout_sources import layout_source
from beacon_mj.scene_gen.template_paths import (
    AssetFolders,
    find_file,
    read_file,
    template_folder,
)

MAX_ELEMENTS = 20_000  #: Of a family with all that it includes.
MAX_FILES = 500  #: That a family refers to, each time counted.
MAX_TOTAL_BYTES = 256_000_000  #: Of all these files.
MAX_DEPTH = 60  #: Of elements in each other, in one file.
MAX_INCLUDES = 8  #: Of files that include each other.
#: Assets that MuJoCo names after their file where they have no name.
_NAMED_BY_FILE = ("mesh", "texture", "hfield", "skin")


@dataclass(frozen=True, slots=True)
class Origin:
    """Where an element of a template stands.

    Attributes:
        path: The file.
        line: The line in it.
        shipped: Whether the file is a shipped one, or an unchanged copy.
        model: The file that stands for a model of its own with all that it includes:
            one that the family includes, or the family.
    """

    path: Path
    line: int
    shipped: bool
    model: Path

    def __str__(self) -> str:
        """Return `file:line`, as errors begin."""
        return f"{self.path}:{self.line}"


@dataclass(slots=True)
class Template:
    """A family file with its includes in place.

    Attributes:
        path: The family file.
        root: All its elements; each file attribute is a key of `assets`.
        origins: Where each element stands.
        parts: The bytes that decide what the family is, in order.
        assets: Content of every mesh or picture; a key holds the content's hash,
            because MuJoCo keeps what it has read, and looks for it under the key alone.
        total_bytes: Of all files that it refers to, each time counted.
    """

    path: Path
    root: ET.Element = field(default_factory=lambda: ET.Element("mujoco"))
    origins: dict[ET.Element, Origin] = field(default_factory=dict)
    parts: list[bytes] = field(default_factory=list)
    assets: dict[str, bytes] = field(default_factory=dict)
    total_bytes: int = 0

    @property
    def folder(self) -> Path:
        """The template folder that the family file belongs to."""
        return template_folder(self.path)

    @property
    def shipped(self) -> bool:
        """Whether all its files are shipped ones, or unchanged copies of them."""
        return all(origin.shipped for origin in self.origins.values())

    @property
    def sha256(self) -> str:
        """SHA-256 of all that decides the family."""
        # Of the parts' digests, so that no two lists of parts read the same.
        digests = b"".join(hashlib.sha256(part).digest() for part in self.parts)
        return hashlib.sha256(digests).hexdigest()


def load_template(path: Path) -> Template:
    """Read a family file and all that it refers to; nothing is compiled.

    An include such as `../obstacles/box.xml` is looked up in the family's own
    template folder first, then among the shipped templates, so that a family file
    can be copied alone.

    Raises:
        TemplateError: If a file is missing, leaves the template folder, or is no XML.
    """
    template = Template(path)
    text = read_file(path)
    template.parts.append(text)
    folders = AssetFolders(path.parent)
    template.root = _expanded(template, text, path, (), folders)
    _check_own_room(template)
    name = template.root.find("custom/text[@name='layout']")
    if name is not None:
        template.parts += layout_source(template.folder, name.get("data", ""))
    return template


def template_sha256(path: Path) -> str:
    """Return the SHA-256 of a family file, all that it refers to, and its layout.

    Raises:
        TemplateError: If a file is missing, leaves the template folder, or is no XML.
    """
    return load_template(path).sha256


def _check_own_room(template: Template) -> None:
    """Refuse a room or a robot of one's own, which no world would have."""
    for origin in dict.fromkeys(template.origins.values()):
        if origin.path.name in ("arena.xml", "robot.xml") and not origin.shipped:
            raise _not_used(origin.path)
    robot = template.folder / "robot.xml"
    if robot.is_file() and read_file(robot) not in _shipped_texts():
        raise _not_used(robot)


def _not_used(path: Path) -> TemplateError:
    return TemplateError(
        f"{path}: expected no room or robot other than the shipped {path.name}: they "
        "are the same in every family. Remove this file."
    )


def _expanded(
    template: Template,
    text: bytes,
    path: Path,
    trail: tuple[Path, ...],
    folders: AssetFolders,
) -> ET.Element:
    """Return the elements of a file, what it includes put in their place."""
    if path in trail:
        raise TemplateError(f"{path}: expected no file to include itself.")
    if len(trail) > MAX_INCLUDES:
        raise TemplateError(
            f"{path}: expected at most {MAX_INCLUDES} files to include one another."
        )
    root, lines = parse_xml(text, path)
    if len(template.origins) + len(lines) > MAX_ELEMENTS:
        raise TemplateError(
            f"{template.path}: expected at most {MAX_ELEMENTS} elements, includes "
            "counted, but it has more."
        )
    if len(template.parts) > 2 * MAX_FILES:
        raise TemplateError(
            f"{template.path}: expected at most {MAX_FILES} references to files but it "
            "has more."
        )
    shipped = _is_shipped(path, text)
    for element in lines:
        model = [*trail, path][:2][-1]
        template.origins[element] = Origin(path, lines[element], shipped, model)
        if element.tag == "compiler":
            folders.take(element, path)
    parents = {child: parent for parent in root.iter() for child in parent}
    for element in lines:
        for name in [k for k in element.attrib if k.startswith("file")]:
            places = folders.places(element, path)
            source = find_file(element.attrib[name], path, template.folder, places)
            content = read_file(source)
            _check_total(template, len(content))
            template.parts += [element.attrib[name].encode(), content]
            if element.tag == "include":
                # What the family includes is a model of its own.
                own = folders if trail else AssetFolders(source.parent)
                included = _expanded(template, content, source, (*trail, path), own)
                _replace(parents[element], element, included)
            else:
                _refer(template, element, name, content)
    return root


def _check_total(template: Template, more: int) -> None:
    template.total_bytes += more
    if template.total_bytes > MAX_TOTAL_BYTES:
        raise TemplateError(
            f"{template.path}: expected files of at most {MAX_TOTAL_BYTES} bytes in "
            "all but they have more."
        )


def _is_shipped(path: Path, text: bytes) -> bool:
    """Whether a file is one of the shipped ones, or an unchanged copy of one."""
    return path.resolve().is_relative_to(ROOT.resolve()) or text in _shipped_texts()


@functools.cache
def _shipped_texts() -> frozenset[bytes]:
    return frozenset(path.read_bytes() for path in ROOT.rglob("*.xml"))


def _replace(parent: ET.Element, include: ET.Element, root: ET.Element) -> None:
    place = list(parent).index(include)
    parent.remove(include)
    for offset, child in enumerate(list(root)):
        parent.insert(place + offset, child)


def _refer(template: Template, element: ET.Element, name: str, content: bytes) -> None:
    """Let an element refer to a file by a key that no other content has."""
    written = PurePosixPath(element.attrib[name])
    if (
        name == "file"
        and element.tag in _NAMED_BY_FILE
        and "name" not in element.attrib
    ):
        element.set("name", written.stem)
    key = f"{hashlib.sha256(content).hexdigest()}_{written.name}"
    template.assets[key] = content
    element.set(name, key)


def parse_xml(
    text: bytes, path: Path | str
) -> tuple[ET.Element, dict[ET.Element, int]]:
    """Return the root of a file, and the line of each element in document order.

    Args:
        text: Its content.
        path: Its name, for messages.

    Raises:
        TemplateError: If it is no XML, or has a document type, entities, or too many
            elements in each other.
    """
    builder, lines, depth = ET.TreeBuilder(), dict[ET.Element, int](), 0
    parser = expat.ParserCreate()

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > MAX_DEPTH:
            raise TemplateError(
                f"{path}: expected at most {MAX_DEPTH} elements in each other."
            )
        lines[builder.start(tag, attributes)] = parser.CurrentLineNumber

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def refuse(*_: object) -> None:
        raise TemplateError(f"{path}: expected no document type or entities.")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler = refuse
    if b"<!ENTITY" in text:
        refuse()
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise TemplateError(f"{path}: not valid XML: {error}") from error
    return builder.close(), lines
