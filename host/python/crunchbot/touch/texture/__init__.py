"""Which surface a whisker sweeps: `model` (the paper's classifier, recordings, decisions of any model) and `spectral`, the default.

`train` learns the default with `fit` (one classifier), `classifier` and `novelty`, whose arithmetic is C.
"""
