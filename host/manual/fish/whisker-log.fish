# Made by tools/manual from what the program says of itself.
complete -c whisker-log -l ring -d 'the ring to read' -x
complete -c whisker-log -l ring-owner -d 'accept a ring of this user, too, not only root'\''s, your own and the service'\''s' -x
complete -c whisker-log -l lanes -d 'lanes 0 to N-1 are populated; others are not judged (28)' -x
complete -c whisker-log -l bad -d 'CSV: lane, tick, code, errors of each bad record' -r
complete -c whisker-log -l summary -d 'JSON: what was counted' -r
complete -c whisker-log -l wait -d 'wait so many seconds for the ring to come up (10)' -x
complete -c whisker-log -l socket -d 'follow the simulation at this socket: it never runs too far ahead' -r
complete -c whisker-log -l version -d 'version of this program'
complete -c whisker-log -l help -d 'this text'
