"""How far along a whisker a contact is: `model` (the paper's line, model files, estimates), `curve`, `press`, and the `plug`."""
