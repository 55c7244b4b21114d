"""Families and obstacles of strangers: refused, or their scenes are made and run."""

import copy
import functools
import os
import sys
import warnings
import xml.etree.ElementTree as ET
from pathlib import Path
from random import Random
from typing import IO, NamedTuple

import pytest

from beacon_mj.mjcf_templates import ROOT
from beacon_mj.scene_gen import limited_reader
from beacon_mj.scene_gen.family import load_family
from beacon_mj.scene_gen.generate import generate_scene
from tests.fuzz.harness import Kind, attempt, kept
from tests.fuzz.mutations import damaged
from tests.fuzz.test_scenes import goes_all_the_way
from tests.scene_gen.test_user_mjcf import body, cuboid

CRATE = body(
    "crate",
    '<freejoint/><geom class="hit" type="mesh" mesh="crate"/><site name="grip"/>'
    '<body name="lid" pos="0 0 0.3" euler="0 0 0.1"><geom type="box" size="0.2 0.2 '
    '0.01"/></body><geom type="capsule" fromto="0 0 0 0 0 0.3" size="0.02"/>',
    head='<compiler angle="radian" meshdir="meshes"/><default><default class="hit">'
    '<geom friction="0.4"/></default></default><asset><mesh name="crate" '
    'file="crate.obj" scale="1 1 1"/><material name="wood" rgba="1 0 0 1"/></asset>',
)
VALUES = (
    "", "0", "-1", "1e300", "nan", "inf", "1e-12", "0.2", "0.2 0.2", "0.3 0.3 0.3",
    "0.1 0.1 0.1 0.1", "x", "true", "crate", "nobody", "sphere", "box", "plane", "sdf",
    "../../../etc/passwd", "/etc/passwd", "crate.obj", "9" * 400, "1 " * 5000, "\u2028",
    "main", "safe", "obstacle", "world",
)  # fmt: skip
NAMES = (
    "name", "type", "size", "pos", "quat", "euler", "axisangle", "mesh", "class",
    "childclass", "file", "scale", "data", "contype", "conaffinity", "fromto", "vertex",
    "angle", "meshdir", "maxhullvert", "mass", "gravcomp", "material", "inertia",
)  # fmt: skip
TAGS = (
    "geom", "body", "site", "frame", "mesh", "joint", "freejoint", "default", "plugin",
    "option", "include", "light", "camera", "numeric", "text", "inertial", "compiler",
)  # fmt: skip
#: What never has a place in a template, by where it is put.
FOREIGN = (
    ("worldbody", "<geom size='1'/>"),
    ("body", "<joint type='hinge'/>"),
    ("body", "<geom type='plane' size='1 1 1'/>"),
    ("body", "<plugin plugin='x'/>"),
    ("body", "<replicate count='9'/>"),
    ("geom", "<plugin plugin='x'/>"),
    ("asset", "<mesh name='m' file='/etc/passwd'/>"),
    ("asset", "<model name='m' file='crate.obj'/>"),
    ("compiler", "<x/>"),
)


class Input(NamedTuple):
    """A family and an obstacle, and whether they must be refused."""

    family: bytes
    obstacle: bytes
    invalid: bool = False


def family() -> str:
    """Return a family of a few crates, quick to make."""
    text = (ROOT / "families" / "sparse.xml").read_text()
    for shipped in (ROOT / "obstacles").glob("*.xml"):
        if shipped.stem != "box":
            text = text.replace(f'<include file="../obstacles/{shipped.name}"/>', "")
    text = text.replace('"obstacle_count" data="5 8"', '"obstacle_count" data="1 2"')
    return text.replace("<custom>", '<include file="obstacles/crate.xml"/><custom>')


def make(rng: Random) -> Input:
    texts = [family(), CRATE]
    k = rng.choice([0, 1, 1])
    if rng.random() < 0.15:
        parts = [text.encode() for text in texts]
        parts[k] = damaged(parts[k], rng)
        return Input(parts[0], parts[1])
    root = ET.fromstring(texts[k])
    if k == 1 and (invalid := rng.random() < 0.3):
        tag, inside = rng.choice(FOREIGN)
        next(root.iter(tag)).append(ET.fromstring(inside))
    else:
        invalid = False
        for _ in range(rng.randint(0, 3)):
            _change(root, rng)
    texts[k] = ET.tostring(root, encoding="unicode")
    data = [text.encode(errors="replace") for text in texts]
    return Input(data[0], data[1], invalid)


def _change(root: ET.Element, rng: Random) -> None:
    parents = [e for e in root.iter() if len(e)]
    parent = rng.choice(parents)
    child = rng.choice(list(parent))
    match rng.randrange(6):
        case 0:
            parent.remove(child)
        case 1:
            child.set(rng.choice([*child.attrib, *NAMES]), rng.choice(VALUES))
        case 2 if child.attrib:
            name = rng.choice([*child.attrib])
            del child.attrib[name]
        case 3:
            parent.append(copy.deepcopy(child))
        case 4:
            attributes = {n: rng.choice(VALUES) for n in rng.sample(NAMES, 2)}
            ET.SubElement(child, rng.choice(TAGS), attributes)
        case _:
            rng.choice(parents).append(copy.deepcopy(child))


def check(given: Input, folder: Path) -> bool:
    """Read the family, make a scene, and drive a little in it."""
    write(given, folder)
    with pytest.MonkeyPatch.context() as patch:
        if hasattr(os, "fork"):
            patch.setattr(limited_reader, "_run", in_a_fork)
        found = attempt(lambda: load_family("fam", folder))
    assert not (given.invalid and found is not None)
    if found is None:
        return True
    scene = attempt(functools.partial(generate_scene, found, 0, templates=folder))
    if scene is None:
        return True
    goes_all_the_way(scene, folder)
    return False


def write(given: Input, folder: Path) -> None:
    (folder / "obstacles" / "meshes").mkdir(parents=True, exist_ok=True)
    (folder / "obstacles" / "meshes" / "crate.obj").write_text(cuboid(0.4, 0.4, 0.3))
    (folder / "obstacles" / "crate.xml").write_bytes(given.obstacle)
    (folder / "fam.xml").write_bytes(given.family)


def in_a_fork(path: Path, out: IO[bytes]) -> int:
    """Do what the limited child does in a copy of this process, which is quicker."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Other threads of this process.
        child = os.fork()
    if child == 0:
        os.dup2(out.fileno(), 1)
        sys.stdout = open(1, "w", closefd=False)
        try:
            limited_reader.main(str(path))
            os._exit(0)
        finally:
            os._exit(3)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


TEMPLATES = Kind("templates", make, check)
test_templates, test_templates_long = TEMPLATES.short(), TEMPLATES.long()


def test_the_templates_that_are_changed_are_sound(tmp_path: Path) -> None:
    assert not check(Input(family().encode(), CRATE.encode()), tmp_path)


def test_kept_templates(tmp_path: Path) -> None:
    for path in kept("templates"):
        check(
            Input(family().encode(), path.read_bytes(), "invalid" in path.name),
            tmp_path,
        )
