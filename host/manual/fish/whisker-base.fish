# Made by tools/manual from what the program says of itself.
complete -c whisker-base -l port -d 'serial port, or the link of an emulator' -r
complete -c whisker-base -l socket -d 'Unix socket to make (messages: docs/create.md)' -r
complete -c whisker-base -l model -d 'Create 1, or Create 2 and Roomba 600 (1)' -x -a '1 2'
complete -c whisker-base -l baud -d 'speed of the line (57600 for model 1, 115200 for model 2)' -x
complete -c whisker-base -l mode -d 'safe: the base stops at cliffs, wheel drops and its charger (safe)' -x -a 'safe full'
complete -c whisker-base -l clock -d 'what the dead-man counts: time, or frames of 15 ms, for lock-step simulation (wall)' -x -a 'wall stream'
complete -c whisker-base -l odometry -d 'auto, reported, requested, encoders (auto)' -x
complete -c whisker-base -l wheel-base -d 'between the wheels, in m (the model'\''s)' -x
complete -c whisker-base -l distance-scale -d 'true distance over reported distance (1)' -x
complete -c whisker-base -l angle-scale -d 'true angle over reported angle (1)' -x
complete -c whisker-base -l relative-sigma -d 'standard deviation of these two scales (0.05)' -x
complete -c whisker-base -l requested-sigma -d 'the same where requested speeds are integrated (0.1)' -x
complete -c whisker-base -l drift -d 'standard deviation of the heading per distance (0.05)' -x
complete -c whisker-base -l wait -d 'wait for the port instead of failing when there is none'
complete -c whisker-base -l verbose -d 'log successful steps, too'
complete -c whisker-base -l version -d 'version of this program'
complete -c whisker-base -l help -d 'this text'
