"""Floor texture: the paper's classifier, the default method, peers."""
