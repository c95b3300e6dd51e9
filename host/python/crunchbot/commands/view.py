"""`whisker view`: the same as whisker-view (crunchbot.view)."""

from ..view.command import EXAMPLE as VIEW_EXAMPLE
from ..view.command import add

__all__ = ["EXAMPLE", "add"]
EXAMPLE = VIEW_EXAMPLE.replace("whisker-view", "whisker view")
