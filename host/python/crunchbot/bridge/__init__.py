"""What comes over the bridge: the ring of frames, which node is on which lane, what a status means, and why nothing comes."""
