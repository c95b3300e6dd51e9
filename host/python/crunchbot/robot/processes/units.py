"""systemd units of a robot's processes, by its process table (parts). whiskerd and whisker-base bring units of their own.

On a real robot systemd starts and restarts the processes, in place of the supervisor (supervisor.py), which is for the
simulation and for runs by hand. A process that hangs is ended by its watchdog: Health feeds it from the main loop.
"""

from dataclasses import dataclass
from pathlib import Path

from .children import Program
from .parts import Meeting

TARGET = "whisker-robot.target"
HELD = (TARGET, "whisker-*.service")  # what stands in a folder of units
WATCHDOG_S = {"pilot": 2, "navigator": 10, "mapper": 10, "bag": 10}  # the view has no such loop
UNIT = """\
[Unit]
Description=Whiskered robot: {name}
PartOf={target}
{order}StartLimitIntervalSec=0

[Service]
{kind}ExecStart={command}
Restart=on-failure
RestartSec=1
TimeoutStopSec=10

DynamicUser=yes
StateDirectory={state}
{groups}ProtectHome=read-only
ProtectClock=yes
ProtectHostname=yes
ProtectKernelLogs=yes
ProtectKernelModules=yes
ProtectKernelTunables=yes
ProtectControlGroups=yes
PrivateDevices=yes
CapabilityBoundingSet=
LockPersonality=yes
RestrictNamespaces=yes
RestrictRealtime=yes
RestrictAddressFamilies=AF_UNIX AF_INET AF_INET6 AF_NETLINK
SystemCallArchitectures=native

[Install]
WantedBy={target}
"""


@dataclass(frozen=True)
class Installed(Meeting):
    """Where services meet: the base's socket is that of whisker-base@PORT, and files are in the services' state folders."""

    port: Path = Path("/dev/ttyUSB0")

    @property
    def reading(self) -> list:
        """The ring is of another user, whiskerd's."""
        return [*super().reading, "--ring-owner", "whisker"]

    @property
    def base(self) -> Path:
        return Path("/run/whisker-base", self.port.name, "base.sock")

    @property
    def base_unit(self) -> str:
        return f"whisker-base@{self.port.name}.service"

    @property
    def checkpoint(self) -> Path:
        return state("navigator") / "navigator.checkpoint"

    @property
    def journal(self) -> Path:
        return state("mapper") / "mapper.journal"

    @property
    def map_folder(self) -> Path:
        return state("mapper") / "map"

    @property
    def bag(self) -> Path:
        return state("bag") / "robot.mcap"


def state(name: str) -> Path:
    """The folder of a service that outlives it."""
    return Path("/var/lib", f"whisker-{name}")


def units(table: list[Program], meeting: Installed) -> dict[str, str]:
    """Text by file name: a service for each program of the table, and the target that starts them all."""
    made = {f"whisker-{program.name}.service": _service(program, meeting) for program in table}
    wanted = ["whiskerd.service", meeting.base_unit, *made]
    text = f"[Unit]\nDescription=Whiskered robot\nWants={' '.join(wanted)}\n\n[Install]\nWantedBy=multi-user.target\n"
    return made | {TARGET: text}


def _service(program: Program, meeting: Installed) -> str:
    order = groups = ""
    if program.moves:
        # The pilot stops the wheels when it ends, so it ends before the base's driver.
        order = f"Wants=whiskerd.service {meeting.base_unit}\nAfter=whiskerd.service {meeting.base_unit}\n"
        groups = "SupplementaryGroups=whisker-base\n"
    watchdog = WATCHDOG_S.get(program.name)
    kind = f"Type=notify\nWatchdogSec={watchdog}\nWatchdogSignal=SIGKILL\n" if watchdog else "Type=exec\n"
    return UNIT.format(
        name=program.name,
        target=TARGET,
        order=order,
        kind=kind,
        command=" ".join(map(_quoted, program.command)),
        state=state(program.name).name,
        groups=groups,
    )


def _quoted(word: str) -> str:
    """A word of ExecStart (systemd.service(5), command lines)."""
    word = word.replace("\\", "\\\\").replace('"', '\\"').replace("%", "%%").replace("$", "$$")
    return f'"{word}"' if not word or any(letter.isspace() for letter in word) or ";" in word else word
