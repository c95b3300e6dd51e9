"""The bridge: in an FPGA, as Verilated gateware and as transactions; the chain behind it; its USB soak."""
