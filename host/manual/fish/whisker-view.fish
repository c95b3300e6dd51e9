# Made by tools/manual from what the program says of itself.
complete -c whisker-view -s h -d 'show this help message and exit'
complete -c whisker-view -l help -d 'show this help message and exit'
complete -c whisker-view -l version -d 'show program'\''s version number and exit'
complete -c whisker-view -l ring -d 'a ring to read from the start; repeatable (default: whisker)' -x
complete -c whisker-view -l ring-owner -d 'accept a ring of this user, too, not only root'\''s, your own and the service'\''s' -x
complete -c whisker-view -l robot -d 'also show the whole robot: arena, belief, path, health (NAME: robot if not given)' -x
complete -c whisker-view -l scene -d 'folder with the robot'\''s arena.toml and robot.toml' -r
complete -c whisker-view -l connect -d 'a process of the robot; repeatable (default: pilot and navigator of this machine)' -x
complete -c whisker-view -l zenoh-config -d 'zenoh'\''s own configuration (JSON5): TLS and access control, see docs/remote.md; endpoints are those given here' -r
complete -c whisker-view -l port -d '0 takes a free one (default: 8028)' -x
complete -c whisker-view -l host -d 'address to serve at (default: 127.0.0.1)' -x
complete -c whisker-view -l allow-host -d 'also answer under this name, as behind a forwarded port; repeatable' -x
complete -c whisker-view -l allow-pose -d 'pages may set where the robot is; on loopback they always may'
complete -c whisker-view -l open -d 'open the page in a browser'
