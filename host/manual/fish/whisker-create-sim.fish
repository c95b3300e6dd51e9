# Made by tools/manual from what the program says of itself.
complete -c whisker-create-sim -l model -d 'Create 1 (57600 baud) or Create 2 (115200 baud) (1)' -x -a '1 2'
complete -c whisker-create-sim -l link -d 'make a symbolic link to the pseudo-terminal' -r
complete -c whisker-create-sim -l arena -d 'flat scene file of its surroundings, with walls to bump into (an open floor)' -r
complete -c whisker-create-sim -l seed -d 'seed of the wheels'\'' errors and of the line'\''s faults (1)' -x
complete -c whisker-create-sim -l drop-remainder -d 'distance and angle forget, when read, what is less than a unit'
complete -c whisker-create-sim -l battery-low -d 'begin with 3 % of the charge'
complete -c whisker-create-sim -l mode-plus-one -d 'firmware that reports a mode one higher than it is'
complete -c whisker-create-sim -l old-angle -d 'firmware up to 3.4.0: angles multiplied by 0.324056'
complete -c whisker-create-sim -l old-distance -d 'firmware before 3.3.0: distance and radius multiplied by F' -x
complete -c whisker-create-sim -l lose-bytes -d 'share of the bytes it sends that are lost' -x
complete -c whisker-create-sim -l flip-bytes -d 'share of them that have a bit flipped' -x
complete -c whisker-create-sim -l extra-bytes -d 'share of them that a random byte follows' -x
complete -c whisker-create-sim -l lose-orders -d 'share of the bytes sent to it that are lost' -x
complete -c whisker-create-sim -l event -d 'WHAT happens S seconds after the start, for L (0.5); repeat it for more. WHAT: bump, bump-left, bump-right, drop-left, drop-right, drop-caster, cliff-left, cliff-front-left, cliff-front-right, cliff-right, virtual-wall, charger, silent' -x
complete -c whisker-create-sim -l version -d 'version of this program'
complete -c whisker-create-sim -l help -d 'this text'
