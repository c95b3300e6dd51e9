"""whisker-view: a process of its own that reads rings and serves a local page of them. The protocol is in docs/view.md."""
