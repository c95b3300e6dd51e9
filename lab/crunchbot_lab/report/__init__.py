"""The demo's report: one HTML file with its figures inside, made from the files of a finished run."""

from .page import write_report

__all__ = ["write_report"]
