# Made by tools/manual from what the program says of itself.
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -s h -d 'show this help message and exit'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -l help -d 'show this help message and exit'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -l version -d 'show program'\''s version number and exit'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a examples -d 'a small data set, with which every example works'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a info -d 'what ring, daemon and bridge say of themselves'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a top -d 'lanes, rates and losses in the terminal'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a view -d 'traces, losses and health in a browser; the same as whisker-view'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a doctor -d 'find out why it does not work'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a calibrate -d 'measure rest and noise, record contacts at known distances'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a bridge-sim -d 'a simulated bridge to try everything with'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a flash -d 'load firmware into the nodes, or gateware into the bridge'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a record -d 'write a ring to an MCAP file'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a replay -d 'feed a ring from a recording, as the device would'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a export -d 'a recording as CSV, Parquet or NWB'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a stream -d 'print frames as CSV or JSON lines'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a robot -d 'all processes of a robot, on hardware or simulated'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a pilot -d 'the netbook'\''s part of a robot: samples to wheel speeds and observations'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a navigator -d 'pose and belief of a robot as its rows come, over the network'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a mapper -d 'map and pose of a robot in an unknown arena as its rows come, over the network'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a ros2 -d 'a running robot as a node of ROS 2, by Zenoh or Cyclone DDS, without ROS: standard messages, frames, /initialpose'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a foxglove -d 'a running robot in Foxglove: pose, belief, whiskers, map, health; a pose set there is obeyed'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a bag -d 'record everything a robot'\''s processes say, for ROS 2 tools'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a pyro -d 'a robot'\''s results as a Pyro object, the paper'\''s interface'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a localise -d 'where the robot was, row by row of a scene folder'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a map -d 'a map of an unknown arena by touch alone, from the rows of a scene folder'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a scene -d 'make scene folders for localise'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a bench -d 'score estimates of any engine on a fixed list of scenes and logs'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a texture -d 'learn and classify floor surfaces'
complete -c whisker -n 'not __fish_seen_subcommand_from examples info top view doctor calibrate bridge-sim flash record replay export stream robot pilot navigator mapper ros2 foxglove bag pyro localise map scene bench texture radial' -f -a radial -d 'learn and estimate the distance of contacts along a whisker'
complete -c whisker -n '__fish_seen_subcommand_from examples' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from examples' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from info' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from info' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from info' -l ring -d 'the ring to read (default: whisker)' -x
complete -c whisker -n '__fish_seen_subcommand_from info' -l ring-owner -d 'accept a ring of this user, too, not only root'\''s, your own and the service'\''s' -x
complete -c whisker -n '__fish_seen_subcommand_from info' -l wait -d 'wait so long for the ring to come up (0)' -x
complete -c whisker -n '__fish_seen_subcommand_from info' -l json -d 'one object on one line'
complete -c whisker -n '__fish_seen_subcommand_from info' -l nodes -d 'who the nodes are, their versions, and what they counted; no sample is lost'
complete -c whisker -n '__fish_seen_subcommand_from top' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from top' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from top' -l ring -d 'the ring to read (default: whisker)' -x
complete -c whisker -n '__fish_seen_subcommand_from top' -l ring-owner -d 'accept a ring of this user, too, not only root'\''s, your own and the service'\''s' -x
complete -c whisker -n '__fish_seen_subcommand_from top' -l wait -d 'wait so long for the ring to come up (0)' -x
complete -c whisker -n '__fish_seen_subcommand_from top' -l interval -d 'between pictures (0.5)' -x
complete -c whisker -n '__fish_seen_subcommand_from top' -l scene -d 'scene folder whose robot.toml names the lanes, lane 0 first' -r
complete -c whisker -n '__fish_seen_subcommand_from top' -l once -d 'print one picture after one interval and leave'
complete -c whisker -n '__fish_seen_subcommand_from view' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from view' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from view' -l ring -d 'a ring to read from the start; repeatable (default: whisker)' -x
complete -c whisker -n '__fish_seen_subcommand_from view' -l ring-owner -d 'accept a ring of this user, too, not only root'\''s, your own and the service'\''s' -x
complete -c whisker -n '__fish_seen_subcommand_from view' -l robot -d 'also show the whole robot: arena, belief, path, health (NAME: robot if not given)' -x
complete -c whisker -n '__fish_seen_subcommand_from view' -l scene -d 'folder with the robot'\''s arena.toml and robot.toml' -r
complete -c whisker -n '__fish_seen_subcommand_from view' -l connect -d 'a process of the robot; repeatable (default: pilot and navigator of this machine)' -x
complete -c whisker -n '__fish_seen_subcommand_from view' -l zenoh-config -d 'zenoh'\''s own configuration (JSON5): TLS and access control, see docs/remote.md; endpoints are those given here' -r
complete -c whisker -n '__fish_seen_subcommand_from view' -l port -d '0 takes a free one (default: 8028)' -x
complete -c whisker -n '__fish_seen_subcommand_from view' -l host -d 'address to serve at (default: 127.0.0.1)' -x
complete -c whisker -n '__fish_seen_subcommand_from view' -l allow-host -d 'also answer under this name, as behind a forwarded port; repeatable' -x
complete -c whisker -n '__fish_seen_subcommand_from view' -l allow-pose -d 'pages may set where the robot is; on loopback they always may'
complete -c whisker -n '__fish_seen_subcommand_from view' -l open -d 'open the page in a browser'
complete -c whisker -n '__fish_seen_subcommand_from doctor' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from doctor' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from doctor' -l ring -d 'the ring that should work (default: whisker)' -x
complete -c whisker -n '__fish_seen_subcommand_from doctor' -l ring-owner -d 'accept a ring of this user, too, not only root'\''s, your own and the service'\''s' -x
complete -c whisker -n '__fish_seen_subcommand_from doctor' -l pattern -d 'prove FPGA, FIFO and USB of a bridge that no whiskerd holds, by its own pattern; no node is needed'
complete -c whisker -n '__fish_seen_subcommand_from doctor' -l serial -d 'with --pattern: the bridge with this serial number' -x
complete -c whisker -n '__fish_seen_subcommand_from calibrate' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from calibrate' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from calibrate' -l ring -d 'the ring to read (default: whisker)' -x
complete -c whisker -n '__fish_seen_subcommand_from calibrate' -l ring-owner -d 'accept a ring of this user, too, not only root'\''s, your own and the service'\''s' -x
complete -c whisker -n '__fish_seen_subcommand_from calibrate' -l wait -d 'wait so long for the ring to come up (0)' -x
complete -c whisker -n '__fish_seen_subcommand_from calibrate' -l out -d 'writes rest.toml, and <lane>.csv with --lane' -r
complete -c whisker -n '__fish_seen_subcommand_from calibrate' -l lane -d 'the whisker to press against the post' -x
complete -c whisker -n '__fish_seen_subcommand_from calibrate' -l radii -d 'distances of the post in mm, as in 90,100,110' -x
complete -c whisker -n '__fish_seen_subcommand_from calibrate' -l repeats -d 'whisks at each distance (5)' -x
complete -c whisker -n '__fish_seen_subcommand_from calibrate' -l rest-seconds -d 'how long rest is measured (2)' -x
complete -c whisker -n '__fish_seen_subcommand_from calibrate' -l whisk-rad-s -d 'turning rate of the whisks, if known' -x
complete -c whisker -n '__fish_seen_subcommand_from calibrate' -l nodes -d 'what '\''whisker info --nodes'\'' printed: the model then belongs to this lane'\''s node, and is refused for others' -r
complete -c whisker -n '__fish_seen_subcommand_from calibrate' -l scene -d 'scene folder whose robot.toml names the lanes, lane 0 first' -r
complete -c whisker -n '__fish_seen_subcommand_from calibrate' -l yes -d 'ask nothing: whisks at the distances follow one another'
complete -c whisker -n '__fish_seen_subcommand_from calibrate' -l backlog -d 'begin with the oldest frame the ring holds, not the next'
complete -c whisker -n '__fish_seen_subcommand_from bridge-sim' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from bridge-sim' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from bridge-sim' -l ring -d 'the ring whiskerd makes (default: whisker)' -x
complete -c whisker -n '__fish_seen_subcommand_from bridge-sim' -l lanes -d 'populated lanes (the scene'\''s whiskers)' -x
complete -c whisker -n '__fish_seen_subcommand_from bridge-sim' -l scene -d 'scene folder (default: the demo'\''s of this seed)' -r
complete -c whisker -n '__fish_seen_subcommand_from bridge-sim' -l fault -d 'TOML: [[fault]] tables with tick or t_s, kind, and, for faults of a lane, lane (and bit or error)' -r
complete -c whisker -n '__fish_seen_subcommand_from bridge-sim' -l seconds -d 'simulated length (a day)' -x
complete -c whisker -n '__fish_seen_subcommand_from bridge-sim' -l mechanics -d 'how finely whiskers bend (static)' -x -a 'static modes'
complete -c whisker -n '__fish_seen_subcommand_from bridge-sim' -l seed -d 'of world, sensors, start (1)' -x
complete -c whisker -n '__fish_seen_subcommand_from bridge-sim' -l drive -d 'turn on the spot, stand still, or whisk: to one side and the other at a body whisk'\''s rate (turn)' -x -a 'turn still whisk'
complete -c whisker -n '__fish_seen_subcommand_from bridge-sim' -l pace -d 'simulated seconds per second, at most what the machine can; 0: as fast as it can (default: 1)' -x
complete -c whisker -n '__fish_seen_subcommand_from bridge-sim' -l level -d 'how much of the bridge is simulated (rtl): the gateware, cycle by cycle, or only around requests and faults' -x -a 'rtl bytes'
complete -c whisker -n '__fish_seen_subcommand_from bridge-sim' -l usbip -d 'no whiskerd: give the device to a Linux kernel by USB/IP, on this port of 127.0.0.1 (3240; 0: a free one)' -x
complete -c whisker -n '__fish_seen_subcommand_from bridge-sim' -l usbredir -d 'the same by usbredir, for a guest in QEMU (4000; 0: a free one)' -x
complete -c whisker -n '__fish_seen_subcommand_from flash' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from flash' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from flash' -l lane -d 'only the node on this lane' -x
complete -c whisker -n '__fish_seen_subcommand_from flash' -l serial -d 'only the node with this serial number' -x
complete -c whisker -n '__fish_seen_subcommand_from flash' -l bridge -d 'the bridge with this serial number' -x
complete -c whisker -n '__fish_seen_subcommand_from flash' -l dry-run -d 'say what would be done, change nothing'
complete -c whisker -n '__fish_seen_subcommand_from flash' -l force -d 'also an image that is older, or of another build (sensor)'
complete -c whisker -n '__fish_seen_subcommand_from record' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from record' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from record' -l ring -d 'the ring to read (default: whisker)' -x
complete -c whisker -n '__fish_seen_subcommand_from record' -l ring-owner -d 'accept a ring of this user, too, not only root'\''s, your own and the service'\''s' -x
complete -c whisker -n '__fish_seen_subcommand_from record' -l wait -d 'wait so long for the ring to come up (0)' -x
complete -c whisker -n '__fish_seen_subcommand_from record' -l frames -d 'stop after so many frames' -x
complete -c whisker -n '__fish_seen_subcommand_from record' -l seconds -d 'stop after so many seconds of frames' -x
complete -c whisker -n '__fish_seen_subcommand_from record' -l scene -d 'scene folder whose robot.toml names the lanes, lane 0 first' -r
complete -c whisker -n '__fish_seen_subcommand_from record' -l overwrite -d 'replace FILE.MCAP if it exists'
complete -c whisker -n '__fish_seen_subcommand_from replay' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from replay' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from replay' -l ring -d 'the ring to make (default: whisker)' -x
complete -c whisker -n '__fish_seen_subcommand_from replay' -l speed -d 'how many times as fast as it was recorded, or max: as fast as the machine can; readers that fall behind by more than the ring lose frames' -x
complete -c whisker -n '__fish_seen_subcommand_from replay' -l ring-frames -d 'a power of two (8192)' -x
complete -c whisker -n '__fish_seen_subcommand_from replay' -l lead -d 'let readers attach for so long first (0.5)' -x
complete -c whisker -n '__fish_seen_subcommand_from export' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from export' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from export' -l lanes -d 'such as 0,2,5-7 (default: those in use)' -x
complete -c whisker -n '__fish_seen_subcommand_from export' -l overwrite -d 'replace OUT if it exists'
complete -c whisker -n '__fish_seen_subcommand_from stream' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from stream' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from stream' -l ring -d 'the ring to read (default: whisker)' -x
complete -c whisker -n '__fish_seen_subcommand_from stream' -l ring-owner -d 'accept a ring of this user, too, not only root'\''s, your own and the service'\''s' -x
complete -c whisker -n '__fish_seen_subcommand_from stream' -l wait -d 'wait so long for the ring to come up (0)' -x
complete -c whisker -n '__fish_seen_subcommand_from stream' -l lanes -d 'such as 0,2,5-7 (default: the lane mask)' -x
complete -c whisker -n '__fish_seen_subcommand_from stream' -l every -d 'print one frame in N, those whose tick is a multiple of N (not filtered: what is faster folds down)' -x
complete -c whisker -n '__fish_seen_subcommand_from stream' -l frames -d 'stop after so many' -x
complete -c whisker -n '__fish_seen_subcommand_from stream' -l backlog -d 'begin with the oldest frame the ring holds, not the next'
complete -c whisker -n '__fish_seen_subcommand_from stream' -l json -d 'JSON lines instead of CSV'
complete -c whisker -n '__fish_seen_subcommand_from robot' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from robot' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from robot' -l models -d 'folder with texture.json and <whisker>.json' -r
complete -c whisker -n '__fish_seen_subcommand_from robot' -l create -d 'the base: iRobot Create (1)' -x -a '1 2'
complete -c whisker -n '__fish_seen_subcommand_from robot' -l port -d 'the base'\''s serial port (default: /dev/ttyUSB0)' -x
complete -c whisker -n '__fish_seen_subcommand_from robot' -l ring -d 'whiskerd'\''s ring (default: whisker)' -x
complete -c whisker -n '__fish_seen_subcommand_from robot' -l no-daemon -d 'use the whiskerd that runs, systemd'\''s for instance, by its --ring'
complete -c whisker -n '__fish_seen_subcommand_from robot' -l map -d 'as --desktop, with a mapper in the navigator'\''s place: of the scene only robot.toml is used, and the map is kept'
complete -c whisker -n '__fish_seen_subcommand_from robot' -l desktop -d 'also the desktop'\''s side: navigator, bag, view'
complete -c whisker -n '__fish_seen_subcommand_from robot' -l view-port -d '(8028)' -x
complete -c whisker -n '__fish_seen_subcommand_from robot' -l out -d 'logs, bag, truth (robot-run)' -r
complete -c whisker -n '__fish_seen_subcommand_from robot' -l no-view -d 'no page for a browser'
complete -c whisker -n '__fish_seen_subcommand_from robot' -l seed -d 'of turns and simulation (1)' -x
complete -c whisker -n '__fish_seen_subcommand_from robot' -l choose -d 'turns and distances: at random, or map: to new floor, by a map of the pilot'\''s own (random)' -x -a 'random map'
complete -c whisker -n '__fish_seen_subcommand_from robot' -l listen -d 'be reached at this address, by anyone who reaches it (default: this machine only)' -x
complete -c whisker -n '__fish_seen_subcommand_from robot' -l first-port -d 'of three, for supervisor, pilot and navigator (default: 7457)' -x
complete -c whisker -n '__fish_seen_subcommand_from robot' -l zenoh-config -d 'zenoh'\''s own configuration (JSON5): TLS and access control, see docs/remote.md; endpoints become tls/ADDRESS:PORT' -r
complete -c whisker -n '__fish_seen_subcommand_from robot' -l simulated -d 'no hardware: the scene (default: the demo'\''s of this seed) with a simulated robot, at the wall clock'\''s pace'
complete -c whisker -n '__fish_seen_subcommand_from robot' -l level -d 'of the simulated bridge (bytes)' -x -a 'bytes rtl'
complete -c whisker -n '__fish_seen_subcommand_from robot' -l seconds -d 'simulated length (a day)' -x
complete -c whisker -n '__fish_seen_subcommand_from robot' -l pace -d 'simulated seconds per second' -x
complete -c whisker -n '__fish_seen_subcommand_from robot' -l units -d 'write systemd units that start these processes on a real robot into this folder, and start nothing' -r
complete -c whisker -n '__fish_seen_subcommand_from pilot' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from pilot' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from pilot' -l models -d 'folder with texture.json and <whisker>.json' -x
complete -c whisker -n '__fish_seen_subcommand_from pilot' -l nodes -d 'what '\''whisker info --nodes'\'' printed: models of other nodes are refused' -x
complete -c whisker -n '__fish_seen_subcommand_from pilot' -l ring -d 'the ring to read (default: whisker)' -x
complete -c whisker -n '__fish_seen_subcommand_from pilot' -l ring-owner -d 'accept a ring of this user, too, not only root'\''s, your own and the service'\''s' -x
complete -c whisker -n '__fish_seen_subcommand_from pilot' -l base -d 'of whisker-base' -x
complete -c whisker -n '__fish_seen_subcommand_from pilot' -l simulation -d 'of a simulation that waits for the pilot; without --base its wheels are driven directly' -x
complete -c whisker -n '__fish_seen_subcommand_from pilot' -l seed -d 'of the random turns (default: 1)' -x
complete -c whisker -n '__fish_seen_subcommand_from pilot' -l choose -d 'turns and distances: at random, or map: to new floor, by a map of the pilot'\''s own (random)' -x -a 'random map'
complete -c whisker -n '__fish_seen_subcommand_from pilot' -l robot -d 'which robot (default: robot)' -x
complete -c whisker -n '__fish_seen_subcommand_from pilot' -l listen -d 'endpoint to be reached at, tcp/HOST:PORT or tls/HOST:PORT; repeatable, or '\''none'\'' (default: tcp/127.0.0.1:7458)' -x
complete -c whisker -n '__fish_seen_subcommand_from pilot' -l connect -d 'endpoint of another process, tcp/HOST:PORT or tls/HOST:PORT; repeatable, or '\''none'\'' (default: tcp/127.0.0.1:7459)' -x
complete -c whisker -n '__fish_seen_subcommand_from pilot' -l scout -d 'also find others, and be found, by multicast'
complete -c whisker -n '__fish_seen_subcommand_from pilot' -l zenoh-config -d 'zenoh'\''s own configuration (JSON5): TLS and access control, see docs/remote.md; endpoints are those given here' -r
complete -c whisker -n '__fish_seen_subcommand_from pilot' -l lock-step -d 'nothing is left out and senders wait: for simulation'
complete -c whisker -n '__fish_seen_subcommand_from pilot' -l await -d 'begin when it is there, too' -x
complete -c whisker -n '__fish_seen_subcommand_from pilot' -l out -d 'observations.csv, as in docs/formats.md' -r
complete -c whisker -n '__fish_seen_subcommand_from pilot' -l traces -d 'CSV of the floor whiskers'\'' deflection' -r
complete -c whisker -n '__fish_seen_subcommand_from pilot' -l report -d 'JSON of what was used, skipped and measured' -r
complete -c whisker -n '__fish_seen_subcommand_from navigator' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from navigator' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from navigator' -l filter -d 'repeatable; the first one'\''s pose is the robot'\''s (default: adaptive)' -x -a 'odometry ekf ukf foveal grid particle multi adaptive'
complete -c whisker -n '__fish_seen_subcommand_from navigator' -l robot -d 'which robot (default: robot)' -x
complete -c whisker -n '__fish_seen_subcommand_from navigator' -l listen -d 'endpoint to be reached at, tcp/HOST:PORT or tls/HOST:PORT; repeatable, or '\''none'\'' (default: tcp/127.0.0.1:7459)' -x
complete -c whisker -n '__fish_seen_subcommand_from navigator' -l connect -d 'endpoint of another process, tcp/HOST:PORT or tls/HOST:PORT; repeatable, or '\''none'\'' (default: tcp/127.0.0.1:7458)' -x
complete -c whisker -n '__fish_seen_subcommand_from navigator' -l scout -d 'also find others, and be found, by multicast'
complete -c whisker -n '__fish_seen_subcommand_from navigator' -l zenoh-config -d 'zenoh'\''s own configuration (JSON5): TLS and access control, see docs/remote.md; endpoints are those given here' -r
complete -c whisker -n '__fish_seen_subcommand_from navigator' -l lock-step -d 'nothing is left out and senders wait: for simulation'
complete -c whisker -n '__fish_seen_subcommand_from navigator' -l out -d 'folder for est_<filter>.csv and covariance_<filter>.csv' -r
complete -c whisker -n '__fish_seen_subcommand_from navigator' -l report -d 'JSON of what was weighed, skipped and missed' -r
complete -c whisker -n '__fish_seen_subcommand_from navigator' -l stay -d 'after the end of a run wait for the next'
complete -c whisker -n '__fish_seen_subcommand_from navigator' -l checkpoint -d 'what is believed, kept in this file and gone on from; a new run wants a new file' -r
complete -c whisker -n '__fish_seen_subcommand_from navigator' -l drill-step -d 'drill: every step takes at least so long (1 is ten times the rows'\'' period)' -x
complete -c whisker -n '__fish_seen_subcommand_from mapper' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from mapper' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from mapper' -l robot -d 'which robot (default: robot)' -x
complete -c whisker -n '__fish_seen_subcommand_from mapper' -l listen -d 'endpoint to be reached at, tcp/HOST:PORT or tls/HOST:PORT; repeatable, or '\''none'\'' (default: tcp/127.0.0.1:7459)' -x
complete -c whisker -n '__fish_seen_subcommand_from mapper' -l connect -d 'endpoint of another process, tcp/HOST:PORT or tls/HOST:PORT; repeatable, or '\''none'\'' (default: tcp/127.0.0.1:7458)' -x
complete -c whisker -n '__fish_seen_subcommand_from mapper' -l scout -d 'also find others, and be found, by multicast'
complete -c whisker -n '__fish_seen_subcommand_from mapper' -l zenoh-config -d 'zenoh'\''s own configuration (JSON5): TLS and access control, see docs/remote.md; endpoints are those given here' -r
complete -c whisker -n '__fish_seen_subcommand_from mapper' -l lock-step -d 'nothing is left out and senders wait: for simulation'
complete -c whisker -n '__fish_seen_subcommand_from mapper' -l out -d 'folder of the map, written at the end of a run: as of whisker map' -x
complete -c whisker -n '__fish_seen_subcommand_from mapper' -l report -d 'JSON of what was taken and missed' -r
complete -c whisker -n '__fish_seen_subcommand_from mapper' -l stay -d 'after the end of a run wait for the next'
complete -c whisker -n '__fish_seen_subcommand_from mapper' -l journal -d 'what was taken, kept in this file and gone on from; a new run wants a new file' -r
complete -c whisker -n '__fish_seen_subcommand_from mapper' -l seed -d 'of every draw (default: 0)' -x
complete -c whisker -n '__fish_seen_subcommand_from ros2' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from ros2' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from ros2' -l rmw -d 'which implementation of ROS 2'\''s middleware reads it (default: zenoh)' -x -a 'zenoh cyclonedds'
complete -c whisker -n '__fish_seen_subcommand_from ros2' -l domain -d 'of ROS 2 (default: ROS_DOMAIN_ID, or 0)' -x
complete -c whisker -n '__fish_seen_subcommand_from ros2' -l router -d 'of rmw_zenoh, tcp/HOST:PORT (default: tcp/localhost:7447)' -x
complete -c whisker -n '__fish_seen_subcommand_from ros2' -l range -d 'who finds it by Cyclone DDS: this machine, or its networks (default: ROS_AUTOMATIC_DISCOVERY_RANGE, or localhost)' -x -a 'localhost subnet'
complete -c whisker -n '__fish_seen_subcommand_from ros2' -l robot -d 'which robot (default: robot)' -x
complete -c whisker -n '__fish_seen_subcommand_from ros2' -l listen -d 'endpoint to be reached at, tcp/HOST:PORT or tls/HOST:PORT; repeatable, or '\''none'\'' (default: none)' -x
complete -c whisker -n '__fish_seen_subcommand_from ros2' -l connect -d 'endpoint of another process, tcp/HOST:PORT or tls/HOST:PORT; repeatable, or '\''none'\'' (default: tcp/127.0.0.1:7458 tcp/127.0.0.1:7459)' -x
complete -c whisker -n '__fish_seen_subcommand_from ros2' -l scout -d 'also find others, and be found, by multicast'
complete -c whisker -n '__fish_seen_subcommand_from ros2' -l zenoh-config -d 'zenoh'\''s own configuration (JSON5): TLS and access control, see docs/remote.md; endpoints are those given here' -r
complete -c whisker -n '__fish_seen_subcommand_from ros2' -l lock-step -d 'nothing is left out and senders wait: for simulation'
complete -c whisker -n '__fish_seen_subcommand_from foxglove' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from foxglove' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from foxglove' -l host -d 'to be reached at (default: 127.0.0.1)' -x
complete -c whisker -n '__fish_seen_subcommand_from foxglove' -l port -d '(default: 8765)' -x
complete -c whisker -n '__fish_seen_subcommand_from foxglove' -l robot -d 'which robot (default: robot)' -x
complete -c whisker -n '__fish_seen_subcommand_from foxglove' -l listen -d 'endpoint to be reached at, tcp/HOST:PORT or tls/HOST:PORT; repeatable, or '\''none'\'' (default: none)' -x
complete -c whisker -n '__fish_seen_subcommand_from foxglove' -l connect -d 'endpoint of another process, tcp/HOST:PORT or tls/HOST:PORT; repeatable, or '\''none'\'' (default: tcp/127.0.0.1:7458 tcp/127.0.0.1:7459)' -x
complete -c whisker -n '__fish_seen_subcommand_from foxglove' -l scout -d 'also find others, and be found, by multicast'
complete -c whisker -n '__fish_seen_subcommand_from foxglove' -l zenoh-config -d 'zenoh'\''s own configuration (JSON5): TLS and access control, see docs/remote.md; endpoints are those given here' -r
complete -c whisker -n '__fish_seen_subcommand_from foxglove' -l lock-step -d 'nothing is left out and senders wait: for simulation'
complete -c whisker -n '__fish_seen_subcommand_from bag' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from bag' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from bag' -l scene -d 'keep this scene folder'\''s files in the bag, and write /tf and /map' -r
complete -c whisker -n '__fish_seen_subcommand_from bag' -l robot -d 'which robot (default: robot)' -x
complete -c whisker -n '__fish_seen_subcommand_from bag' -l listen -d 'endpoint to be reached at, tcp/HOST:PORT or tls/HOST:PORT; repeatable, or '\''none'\'' (default: none)' -x
complete -c whisker -n '__fish_seen_subcommand_from bag' -l connect -d 'endpoint of another process, tcp/HOST:PORT or tls/HOST:PORT; repeatable, or '\''none'\'' (default: tcp/127.0.0.1:7458 tcp/127.0.0.1:7459)' -x
complete -c whisker -n '__fish_seen_subcommand_from bag' -l scout -d 'also find others, and be found, by multicast'
complete -c whisker -n '__fish_seen_subcommand_from bag' -l zenoh-config -d 'zenoh'\''s own configuration (JSON5): TLS and access control, see docs/remote.md; endpoints are those given here' -r
complete -c whisker -n '__fish_seen_subcommand_from bag' -l lock-step -d 'nothing is left out and senders wait: for simulation'
complete -c whisker -n '__fish_seen_subcommand_from bag' -l stay -d 'go on after the end of a run'
complete -c whisker -n '__fish_seen_subcommand_from bag' -l overwrite -d 'replace FILE.MCAP if it exists'
complete -c whisker -n '__fish_seen_subcommand_from bag' -l next -d 'if FILE.MCAP exists, leave it and write FILE-2.MCAP, FILE-3.MCAP ...: for a recorder that is started again'
complete -c whisker -n '__fish_seen_subcommand_from pyro' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from pyro' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from pyro' -l robot -d 'which robot (default: robot)' -x
complete -c whisker -n '__fish_seen_subcommand_from pyro' -l listen -d 'endpoint to be reached at, tcp/HOST:PORT or tls/HOST:PORT; repeatable, or '\''none'\'' (default: none)' -x
complete -c whisker -n '__fish_seen_subcommand_from pyro' -l connect -d 'endpoint of another process, tcp/HOST:PORT or tls/HOST:PORT; repeatable, or '\''none'\'' (default: tcp/127.0.0.1:7458 tcp/127.0.0.1:7459)' -x
complete -c whisker -n '__fish_seen_subcommand_from pyro' -l scout -d 'also find others, and be found, by multicast'
complete -c whisker -n '__fish_seen_subcommand_from pyro' -l zenoh-config -d 'zenoh'\''s own configuration (JSON5): TLS and access control, see docs/remote.md; endpoints are those given here' -r
complete -c whisker -n '__fish_seen_subcommand_from pyro' -l lock-step -d 'nothing is left out and senders wait: for simulation'
complete -c whisker -n '__fish_seen_subcommand_from pyro' -l host -d 'address to serve at (default: 127.0.0.1)' -x
complete -c whisker -n '__fish_seen_subcommand_from pyro' -l port -d '0 takes a free one (7450)' -x
complete -c whisker -n '__fish_seen_subcommand_from pyro' -l write -d 'let clients write rows, as the paper'\''s netbook did; without a pilot beside it'
complete -c whisker -n '__fish_seen_subcommand_from localise' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from localise' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from localise' -l filter -d 'see --list-filters (default: adaptive)' -x
complete -c whisker -n '__fish_seen_subcommand_from localise' -l seed -d 'of every random draw (default: 0)' -x
complete -c whisker -n '__fish_seen_subcommand_from localise' -l set -d 'change a setting, see --list-settings' -x
complete -c whisker -n '__fish_seen_subcommand_from localise' -l out -d 'write t_s, x_m, y_m, theta_rad, confidence of every row' -r
complete -c whisker -n '__fish_seen_subcommand_from localise' -l map -d 'occupancy map (a ROS map server'\''s YAML file): its boxes in place of arena.toml'\''s, or of all of it where there is none' -r
complete -c whisker -n '__fish_seen_subcommand_from localise' -l json -d 'print the summary as one line of JSON'
complete -c whisker -n '__fish_seen_subcommand_from localise' -l list-filters -d 'print the filters'\'' names and leave'
complete -c whisker -n '__fish_seen_subcommand_from localise' -l list-settings -d 'print the settings with defaults and ranges and leave'
complete -c whisker -n '__fish_seen_subcommand_from map' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from map' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from map' -l out -d 'folder to write: a scene for localise, and map.yaml' -x
complete -c whisker -n '__fish_seen_subcommand_from map' -l particles -d 'hypotheses held at a time (default: 12)' -x
complete -c whisker -n '__fish_seen_subcommand_from map' -l seed -d 'of every draw (default: 0)' -x
complete -c whisker -n '__fish_seen_subcommand_from map' -l no-lattice -d 'do not look for a lattice of tiles'
complete -c whisker -n '__fish_seen_subcommand_from map' -l json -d 'print the summary as one line of JSON'
complete -c whisker -n '__fish_seen_subcommand_from scene; and not __fish_seen_subcommand_from make from map' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from scene; and not __fish_seen_subcommand_from make from map' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from scene; and not __fish_seen_subcommand_from make from map' -f -a make -d 'draw a scene of a family, observations and truth included'
complete -c whisker -n '__fish_seen_subcommand_from scene; and not __fish_seen_subcommand_from make from map' -f -a from -d 'make a scene of a run'\''s recording'
complete -c whisker -n '__fish_seen_subcommand_from scene; and not __fish_seen_subcommand_from make from map' -f -a map -d 'put an occupancy map into a scene folder, for all commands that take one'
complete -c whisker -n '__fish_seen_subcommand_from scene; and __fish_seen_subcommand_from make' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from scene; and __fish_seen_subcommand_from make' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from scene; and __fish_seen_subcommand_from make' -l family -d 'a base and any modifiers, joined by '\''+'\''; see --list-families' -x
complete -c whisker -n '__fish_seen_subcommand_from scene; and __fish_seen_subcommand_from make' -l seed -d 'draws arena, path and noise (default: 0)' -x
complete -c whisker -n '__fish_seen_subcommand_from scene; and __fish_seen_subcommand_from make' -l steps -d 'rows of 0.1 s (default: the family'\''s)' -x
complete -c whisker -n '__fish_seen_subcommand_from scene; and __fish_seen_subcommand_from make' -l out -d 'folder to write' -r
complete -c whisker -n '__fish_seen_subcommand_from scene; and __fish_seen_subcommand_from make' -l list-families -d 'print bases and modifiers and leave'
complete -c whisker -n '__fish_seen_subcommand_from scene; and __fish_seen_subcommand_from from' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from scene; and __fish_seen_subcommand_from from' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from scene; and __fish_seen_subcommand_from from' -l out -d 'folder to write' -r
complete -c whisker -n '__fish_seen_subcommand_from scene; and __fish_seen_subcommand_from map' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from scene; and __fish_seen_subcommand_from map' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from scene; and __fish_seen_subcommand_from map' -l out -d 'folder to write' -r
complete -c whisker -n '__fish_seen_subcommand_from bench; and not __fish_seen_subcommand_from touch map' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from bench; and not __fish_seen_subcommand_from touch map' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from bench; and not __fish_seen_subcommand_from touch map' -f -a touch -d 'where the robot is, by touch'
complete -c whisker -n '__fish_seen_subcommand_from bench; and not __fish_seen_subcommand_from touch map' -f -a map -d 'a map by touch alone, and the poses that it was made with'
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from touch' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from touch' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from touch' -l list -d 'print the scenes of the list and leave'
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from touch' -l scene -d 'a scene of the list, or a scene folder with true poses' -x
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from touch' -l data -d 'folder of the logs, as DIR/thymio/random_1' -r
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from touch' -l estimate -d 'x_m, y_m, theta_rad, as in docs/formats.md, of any engine' -r
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from touch' -l filter -d 'run this one of whisker'\''s filters in place of --estimate' -x -a 'odometry ekf ukf foveal grid particle multi adaptive'
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from touch' -l out -d 'write the scene'\''s folder, for an engine of your own to run on' -r
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from touch' -l near -d 'a row is near within so much (default: 0.06)' -x
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from touch' -l chart -d 'draw error and bits over the way, as SVG or PNG' -r
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from touch' -l peers -d 'stored figures of other engines' -r
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from touch' -l json -d 'print the scores as one line of JSON'
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from map' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from map' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from map' -l scene -d 'a family of scenes (see whisker scene make --list), or a scene folder with true poses (default: anchor)' -x
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from map' -l seed -d 'of a family'\''s scene (default: 1)' -x
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from map' -l rows -d 'of a family'\''s scene (default: 3000)' -x
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from map' -l estimate -d 'judge these poses, in the frame of the first one, of any engine (docs/formats.md), in place of whisker map'\''s' -r
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from map' -l particles -d 'as whisker map'\''s' -x
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from map' -l own -d 'locate another drive in the map that was made, beside the true one'
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from map' -l out -d 'write the scene'\''s folder, for an engine of your own to run on' -r
complete -c whisker -n '__fish_seen_subcommand_from bench; and __fish_seen_subcommand_from map' -l json -d 'print the scores as one line of JSON'
complete -c whisker -n '__fish_seen_subcommand_from texture; and not __fish_seen_subcommand_from train classify' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from texture; and not __fish_seen_subcommand_from train classify' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from texture; and not __fish_seen_subcommand_from train classify' -f -a train -d 'learn from one folder per surface, one CSV per recording'
complete -c whisker -n '__fish_seen_subcommand_from texture; and not __fish_seen_subcommand_from train classify' -f -a classify -d 'classify the surface window by window'
complete -c whisker -n '__fish_seen_subcommand_from texture; and __fish_seen_subcommand_from train' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from texture; and __fish_seen_subcommand_from train' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from texture; and __fish_seen_subcommand_from train' -l out -d '' -r
complete -c whisker -n '__fish_seen_subcommand_from texture; and __fish_seen_subcommand_from train' -l method -d 'default: spectra, calibrated on recordings held out; naive-bayes: the paper'\''s equation 1' -x -a 'naive-bayes default'
complete -c whisker -n '__fish_seen_subcommand_from texture; and __fish_seen_subcommand_from train' -l window-ms -d 'window to train for, of method default: 100.0' -x
complete -c whisker -n '__fish_seen_subcommand_from texture; and __fish_seen_subcommand_from train' -l speed-m-s -d 'of a drive, with --tile-m: how often the surface changes; default: once in fifty windows' -x
complete -c whisker -n '__fish_seen_subcommand_from texture; and __fish_seen_subcommand_from train' -l tile-m -d 'length of one surface along a drive, with --speed-m-s' -x
complete -c whisker -n '__fish_seen_subcommand_from texture; and __fish_seen_subcommand_from classify' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from texture; and __fish_seen_subcommand_from classify' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from texture; and __fish_seen_subcommand_from classify' -l window-ms -d 'length of a window (default: 100.0)' -x
complete -c whisker -n '__fish_seen_subcommand_from texture; and __fish_seen_subcommand_from classify' -l sequential -d 'answer as soon as sure, "unknown" after four windows'
complete -c whisker -n '__fish_seen_subcommand_from texture; and __fish_seen_subcommand_from classify' -l json -d 'one object per line and window; of a folder: per surface'
complete -c whisker -n '__fish_seen_subcommand_from radial; and not __fish_seen_subcommand_from fit predict follow' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from radial; and not __fish_seen_subcommand_from fit predict follow' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from radial; and not __fish_seen_subcommand_from fit predict follow' -f -a fit -d 'fit contacts of known radius'
complete -c whisker -n '__fish_seen_subcommand_from radial; and not __fish_seen_subcommand_from fit predict follow' -f -a predict -d 'estimate the radius of each contact'
complete -c whisker -n '__fish_seen_subcommand_from radial; and not __fish_seen_subcommand_from fit predict follow' -f -a follow -d 'estimate where each contact is while it is pressed'
complete -c whisker -n '__fish_seen_subcommand_from radial; and __fish_seen_subcommand_from fit' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from radial; and __fish_seen_subcommand_from fit' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from radial; and __fish_seen_subcommand_from fit' -l out -d '' -r
complete -c whisker -n '__fish_seen_subcommand_from radial; and __fish_seen_subcommand_from fit' -l model -d 'paper or linear: equation 3, a line through the peaks; quadratic, rational: a curve instead; whisk: whole body whisks by the physics of the shaft, which the pilot needs to tell a face from a corner; press: a regression at several depths of a push, which answers during the press; default: the one that predicts left-out places best' -x -a 'paper linear quadratic rational whisk press default'
complete -c whisker -n '__fish_seen_subcommand_from radial; and __fish_seen_subcommand_from predict' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from radial; and __fish_seen_subcommand_from predict' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from radial; and __fish_seen_subcommand_from predict' -l json -d 'one object per line and contact'
complete -c whisker -n '__fish_seen_subcommand_from radial; and __fish_seen_subcommand_from predict' -l during -d 'a press model'\''s answers as each contact grows, one line for every tenth of its samples'
complete -c whisker -n '__fish_seen_subcommand_from radial; and __fish_seen_subcommand_from follow' -s h -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from radial; and __fish_seen_subcommand_from follow' -l help -d 'show this help message and exit'
complete -c whisker -n '__fish_seen_subcommand_from radial; and __fish_seen_subcommand_from follow' -l json -d 'one object per line, one every 20 ms at 2 kHz'
