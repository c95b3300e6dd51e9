"""Mutation testing: one-line changes drawn at random from the product's C, Verilog and Python, each met by the tests."""
