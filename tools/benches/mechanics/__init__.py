"""Whisker mechanics beside a chain of rigid links."""
