// The protocol's CRC-8, most significant bit first. Included inside a module, after whisker_protocol.vh.

// The register after one more byte. The CRC of a message is the register after its bytes, starting from CRC8_INIT,
// XORed with CRC8_XOR_OUT.
function automatic [7:0] crc8_byte(input [7:0] state, input [7:0] next);
    integer i;
    begin
        crc8_byte = state ^ next;
        for (i = 0; i < 8; i = i + 1)
            crc8_byte = {crc8_byte[6:0], 1'b0} ^ (crc8_byte[7] ? CRC8_POLYNOMIAL[7:0] : 8'h00);
    end
endfunction
