# Made by tools/manual from what the program says of itself.
complete -c whisker-bridge-sim -l scene -d 'flat scene file: arena, robot, start pose' -r
complete -c whisker-bridge-sim -l seconds -d 'simulated length of the run' -x
complete -c whisker-bridge-sim -l pace -d 'at most X simulated seconds per second; the world then goes on while nobody takes frames' -x
complete -c whisker-bridge-sim -l seed -d 'seed of world, sensors and faults (1)' -x
complete -c whisker-bridge-sim -l socket -d 'where followers and the pilot connect' -r
complete -c whisker-bridge-sim -l followers -d 'wait for so many of them, the pilot included (0)' -x
complete -c whisker-bridge-sim -l truth -d 'pose and texture tips after every 0.1 s' -r
complete -c whisker-bridge-sim -l wheels -d 'each change of what the Create'\''s wheels are ordered: tick, monotonic clock, speeds' -r
complete -c whisker-bridge-sim -l faults -d 'inject lane and USB faults; log each spoilt lane,tick,kind' -r
complete -c whisker-bridge-sim -l usb-faults -d 'log each USB fault: tick,kind' -r
complete -c whisker-bridge-sim -l fault-list -d 'inject just these: lines '\''lane TICK LANE KIND ARGUMENT'\'', '\''usb TICK KIND'\'', ticks rising' -r
complete -c whisker-bridge-sim -l nodes -d 'single nodes'\'' traits: lines '\''LANE serial N'\'', '\''LANE chip ID'\'', '\''LANE cut BLOCK'\''' -r
complete -c whisker-bridge-sim -l flash -d 'the configuration flash (1 MiB), made if it is not there; a gateware update changes it' -r
complete -c whisker-bridge-sim -l flash-cut -d 'power goes in the midst of the write to it after N; the run ends' -x
complete -c whisker-bridge-sim -l lanes-populated -d 'nodes on the first N lanes; those without a whisker are at rest (the scene'\''s; bench: 6)' -x
complete -c whisker-bridge-sim -l speed-report -d 'ticks, clock cycles, wall seconds, fault counts' -r
complete -c whisker-bridge-sim -l defect -d 'misbehave: wire-version (claims another), frame (damages one) or truncate (cuts one)' -x
complete -c whisker-bridge-sim -l level -d 'the Verilated bridge, cycle by cycle; or that around requests and faults, and its model of bytes in between: the same frames (rtl)' -x -a 'rtl bytes mixed'
complete -c whisker-bridge-sim -l rtl-seconds -d 'level mixed: cycle by cycle for the first S simulated seconds (0)' -x
complete -c whisker-bridge-sim -l usbip -d 'serve the device by USB/IP on this port of 127.0.0.1 (0: a free one, which is printed)' -x
complete -c whisker-bridge-sim -l usbredir -d 'serve it by usbredir, for QEMU'\''s usb-redir' -x
complete -c whisker-bridge-sim -l unplugged -d 'begin without the bridge, until '\''plug'\'' comes by the socket'
complete -c whisker-bridge-sim -l progress -d 'a line '\''progress TICK TICKS'\'' every simulated second (default on a terminal)'
complete -c whisker-bridge-sim -l bench -d 'no COMMAND, no umockdev: an internal host reads and checks every frame'
complete -c whisker-bridge-sim -l sck-divider -d 'bench: node link, in cycles of 60 MHz (6)' -x
complete -c whisker-bridge-sim -l word-gap -d 'bench: the same (30)' -x
complete -c whisker-bridge-sim -l sample-point -d 'bench: the same (5)' -x
complete -c whisker-bridge-sim -l create -d 'the base is an iRobot Create behind a serial port; the pilot answers with '\''base T N'\''' -x -a '1 2'
complete -c whisker-bridge-sim -l create-link -d 'where that port, a pseudo-terminal, is linked' -r
complete -c whisker-bridge-sim -l create-drop-remainder -d 'distance and angle forget, when read, what is less than a unit'
complete -c whisker-bridge-sim -l create-battery-low -d 'begin with 3 % of the charge'
complete -c whisker-bridge-sim -l create-mode-plus-one -d 'firmware that reports a mode one higher than it is'
complete -c whisker-bridge-sim -l create-old-angle -d 'firmware up to 3.4.0: angles multiplied by 0.324056'
complete -c whisker-bridge-sim -l create-old-distance -d 'firmware before 3.3.0: distance and radius multiplied by F' -x
complete -c whisker-bridge-sim -l create-lose-bytes -d 'share of the bytes it sends that are lost' -x
complete -c whisker-bridge-sim -l create-flip-bytes -d 'share of them that have a bit flipped' -x
complete -c whisker-bridge-sim -l create-extra-bytes -d 'share of them that a random byte follows' -x
complete -c whisker-bridge-sim -l create-lose-orders -d 'share of the bytes sent to it that are lost' -x
complete -c whisker-bridge-sim -l create-event -d 'WHAT happens S seconds after the start, for L (0.5); repeat it for more. WHAT: bump, bump-left, bump-right, drop-left, drop-right, drop-caster, cliff-left, cliff-front-left, cliff-front-right, cliff-right, virtual-wall, charger, silent' -x
complete -c whisker-bridge-sim -l version -d 'version of this program'
complete -c whisker-bridge-sim -l help -d 'this text'
