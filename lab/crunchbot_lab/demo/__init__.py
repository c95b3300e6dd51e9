"""The demo: makes a scene, trains and calibrates, runs the chain on simulated hardware, localises, reports."""
