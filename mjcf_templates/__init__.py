"""The MJCF templates: arena, robot, obstacle shapes, scene families."""

from pathlib import Path

#: Folder of the shipped templates.
ROOT = Path(__file__).parent
