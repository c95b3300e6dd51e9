# Made by tools/manual from what the program says of itself.
complete -c whisker-flash -l lane -d 'only the node on this lane; it needs a serial number of its own' -x
complete -c whisker-flash -l node -d 'only the node with this serial number' -x
complete -c whisker-flash -l dry-run -d 'say what would be done and whether the nodes would take it; change nothing'
complete -c whisker-flash -l force -d 'also an image that is older than what a node (or the bridge) runs, or of another build (sensor)'
complete -c whisker-flash -l list -d 'who the nodes are'
complete -c whisker-flash -l health -d 'with --list: their fault counters that are not zero'
complete -c whisker-flash -l bridge -d 'the bridge with this serial number (the first that can be opened)' -x
complete -c whisker-flash -l sck-divider -d 'as whiskerd, at most 16 (16)' -x
complete -c whisker-flash -l word-gap -d 'as whiskerd, at most 180 (180)' -x
complete -c whisker-flash -l sample-point -d 'as whiskerd (8)' -x
complete -c whisker-flash -l version -d 'version of this program'
complete -c whisker-flash -l help -d 'this text'
