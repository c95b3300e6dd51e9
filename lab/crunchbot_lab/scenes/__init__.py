"""Scenes at level 0: what whiskers would read, without the signals between. Families by name and seed, recordings."""

from .families import BASES, MODIFIERS, FamilyError, recipe
from .files import rounded, write_scene
from .making import Made, make
from .recordings import READERS, RecordingKindError, read_recording

__all__ = [
    "BASES",
    "MODIFIERS",
    "READERS",
    "FamilyError",
    "Made",
    "RecordingKindError",
    "make",
    "read_recording",
    "recipe",
    "rounded",
    "write_scene",
]
