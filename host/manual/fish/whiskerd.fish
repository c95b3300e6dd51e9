# Made by tools/manual from what the program says of itself.
complete -c whiskerd -l ring -d 'name of the ring; readers attach to it' -x
complete -c whiskerd -l ring-frames -d 'its capacity, a power of two (8192)' -x
complete -c whiskerd -l serial -d 'the bridge with this serial number (the first that can be opened)' -x
complete -c whiskerd -l wait -d 'wait for a bridge instead of failing when there is none'
complete -c whiskerd -l once -d 'end when the bridge goes, instead of waiting for it'
complete -c whiskerd -l replace -d 'stop the whiskerd that has this ring, if it is yours, root'\''s or the service'\''s, and take over'
complete -c whiskerd -l list -d 'print serial number, place and state of each bridge'
complete -c whiskerd -l batch -d 'frames of one USB transfer, even, 2 to 64: latency against work (4)' -x
complete -c whiskerd -l lane-mask -d 'bit n set: lane n is in use (0xfffffff)' -x
complete -c whiskerd -l tick-period -d 'cycles of 60 MHz from tick to tick (30000)' -x
complete -c whiskerd -l sck-divider -d 'cycles of 60 MHz of one SCK period (16)' -x
complete -c whiskerd -l word-gap -d 'cycles of 60 MHz between two 16-bit words (180)' -x
complete -c whiskerd -l sample-point -d 'cycles of 60 MHz from shifting to sampling (8)' -x
complete -c whiskerd -l tick-in -d 'ticks begin with the rising or the falling edges of the bridge'\''s pin tick_in, a tick period apart: another bridge'\''s tick_out, a camera, a PPS' -x
complete -c whiskerd -l every-frame -d 'the bridge sends each frame at once instead of two in a packet'
complete -c whiskerd -l pattern -d 'records of the bridge'\''s own in place of the nodes'\'': proves FPGA, FIFO and USB'
complete -c whiskerd -l verbose -d 'log successful steps, too'
complete -c whiskerd -l version -d 'version of this program'
complete -c whiskerd -l help -d 'this text'
