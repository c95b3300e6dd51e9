"""How the processes of a robot are started, watched and ended: process table, supervisor, systemd units."""
