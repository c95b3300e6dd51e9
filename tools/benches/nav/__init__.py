"""The filters: speed against accuracy, the paper's figures, other projects' filters."""
