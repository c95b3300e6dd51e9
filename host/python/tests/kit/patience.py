"""How long tests wait for what must come: a test that fails ends, and on a machine at load 15 none fails for haste."""

PATIENCE_S = 120.0
