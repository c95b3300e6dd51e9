"""The simulated world at level 1: sensor counts without hardware, simulated or real, between."""

from .world import TICK_S, Contact, Tip, World

__all__ = ["TICK_S", "Contact", "Tip", "World"]
