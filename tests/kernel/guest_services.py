"""Runs inside the services' guest, as root: what udev, systemd and other users make of what is installed."""

import os
import pwd
import re
import signal
import socket
import stat
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path

from guest_talk import Checks, Talk, attach, await_that, command, detach, require

UNITS = Path("/usr/local/lib/systemd/system")
DAEMON = "whiskerd.service"
BASES = ("ttyUSB0", "ttyUSB1")
RING = "whisker"
FRAMES = 2000
PROBE = Path(__file__).with_name("kernel_ring_probe")
NOBODY = 65534
ASLEEP = Path("/run/asleep")
WHEELS_M_S = 0.1
STILL_M = 0.002  # what a base may still report when it stands
MOTION_M = 0.05


# ----------------------------------------------------------------------------------------------------------- systemd


def show(unit: str, name: str) -> str:
    """A property of a unit, as systemd reports it."""
    return command("systemctl", "show", "--property", name, "--value", unit).strip()


def processes(unit: str) -> list[int]:
    """Process ids of a unit's control group."""
    group = show(unit, "ControlGroup")
    path = Path("/sys/fs/cgroup") / group.lstrip("/") / "cgroup.procs"
    return [int(line) for line in path.read_text().split()] if group and path.exists() else []


def await_active(unit: str, since: int = 0) -> None:
    """Until the unit is active, and was started again by systemd more often than `since`."""
    # The restarts first: an active unit of before is not taken for the next one.
    await_that(
        lambda: int(show(unit, "NRestarts")) >= since and show(unit, "ActiveState") == "active",
        f"{unit} is not active with {since} restarts",
    )


def restarted(unit: str, sent: signal.Signals) -> float:
    """Send a signal to all processes of the unit; seconds until systemd has it running again, with other processes."""
    before, restarts = processes(unit), int(show(unit, "NRestarts"))
    require(bool(before), f"{unit} has no process")
    began = time.monotonic()
    for pid in before:
        os.kill(pid, sent)
    await_active(unit, restarts + 1)
    took = time.monotonic() - began
    left = set(before) & set(processes(unit))
    require(not left, f"processes {left} of before live on")
    return took


# ------------------------------------------------------------------------------------------------------- other users


def as_user(uid: int, groups: list[int], attempt: Callable[[], object]) -> str:
    """What the attempt returned, or the name of the OSError that it ended with, in a process of this user."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.setgroups(groups)
        os.setresgid(NOBODY, NOBODY, NOBODY)
        os.setresuid(uid, uid, uid)
        try:
            reported = str(attempt())
        except OSError as error:
            reported = type(error).__name__
        os.write(write, reported.encode())
        os._exit(0)
    os.close(write)
    with os.fdopen(read) as answer:
        reported = answer.read()
    os.waitpid(child, 0)
    return reported


def group_of(user: str) -> int:
    """The group of a service's user."""
    return pwd.getpwnam(user).pw_gid


def owner_and_mode(path: Path) -> str:
    """Like whisker:whisker 0644."""
    info = path.stat()
    return f"{path.owner()}:{path.group()} {stat.S_IMODE(info.st_mode):04o}"


# --------------------------------------------------------------------------------------------------------- the bridge


def boots(_: Checks) -> str:
    """systemd reaches its default target and no unit of the system has failed."""
    await_that(lambda: show("multi-user.target", "ActiveState") == "active", "no multi-user.target")
    failed = command("systemctl", "--failed", "--plain", "--no-legend").strip()
    require(not failed, failed)
    return command("systemctl", "--version").splitlines()[0] + ", " + command("systemd-analyze", "time").splitlines()[0]


def users(_: Checks) -> str:
    """After an install by hand, as docs/install.md says: sysusers makes the users, who cannot log in."""
    command("systemd-sysusers")
    command("udevadm", "control", "--reload")
    command("systemctl", "daemon-reload")
    made = [pwd.getpwnam(name) for name in ("whisker", "whisker-base")]
    shells = {entry.pw_shell for entry in made}
    require(shells == {"/usr/sbin/nologin"}, f"shells {shells}")
    require(all(0 < entry.pw_uid < 1000 for entry in made), f"no system users: {made}")
    return ", ".join(f"{entry.pw_name} {entry.pw_uid}" for entry in made)


def verify(_: Checks) -> None:
    """systemd finds nothing to say about the units."""
    paths = [str(path) for path in sorted(UNITS.glob("*.service"))]
    done = subprocess.run(["systemd-analyze", "verify", *paths], capture_output=True, text=True)
    require(len(paths) == 2 and done.returncode == 0 and not done.stderr, done.stderr or f"units: {paths}")


def ring_files() -> list[Path]:
    """The ring, wherever whiskerd has put it."""
    found = [folder / RING for folder in (Path("/run/whiskerd"), Path("/dev/shm")) if (folder / RING).exists()]
    return found


def read_ring(uid: int = NOBODY) -> str:
    """A reader of this user, without any rights, takes frames, each in its place; its last line."""
    done = subprocess.run(
        [PROBE, RING, str(FRAMES)], capture_output=True, text=True, user=uid, group=NOBODY, extra_groups=[]
    )
    require(done.returncode == 0, f"the reader: {done.stderr.strip()}")
    return done.stdout.strip().splitlines()[-1]


def plug_starts_daemon(checks: Checks) -> str:
    """udev starts whiskerd when the bridge is plugged in; it runs as its user, without capabilities."""
    require(show(DAEMON, "ActiveState") == "inactive", "whiskerd runs without a bridge")
    attach(checks.talk.ask("usbip"))
    await_active(DAEMON)
    status = Path(f"/proc/{show(DAEMON, 'MainPID')}/status").read_text()
    facts = dict(line.split(":\t", 1) for line in status.splitlines() if ":\t" in line)
    uid = pwd.getpwnam("whisker").pw_uid
    require(facts["Uid"].split()[1] == str(uid), f"uid {facts['Uid']}")
    require(int(facts["CapEff"], 16) == 0 and facts["NoNewPrivs"] == "1" and facts["Seccomp"] == "2", status)
    return f"uid {uid}, no capability, seccomp"


def ring_place(_: Checks) -> str:
    """The ring is in the daemon's folder, everybody may read it, the daemon alone may write."""
    await_that(ring_files, "there is no ring")
    found = ring_files()
    require([path.parent.name for path in found] == ["whiskerd"], f"ring at {', '.join(map(str, found))}")
    reported = f"{owner_and_mode(found[0].parent)}, {owner_and_mode(found[0])}"
    require(reported == "whisker:whisker 0755, whisker:whisker 0644", reported)
    return reported


def ring_of_another_user(_: Checks) -> str:
    """A user without any group reads every frame."""
    return read_ring()


def bridge_access(_: Checks) -> str:
    """Members of the group whisker may open the bridge, others may not."""
    node = next(
        Path("/dev") / line.split("=")[1]
        for vendor in Path("/sys/bus/usb/devices").glob("*/idVendor")
        if vendor.read_text().strip() == "1209"
        for line in (vendor.parent / "uevent").read_text().splitlines()
        if line.startswith("DEVNAME=")
    )
    outcomes = [
        as_user(NOBODY, groups, lambda: os.close(os.open(node, os.O_RDWR))) for groups in ([], [group_of("whisker")])
    ]
    require(outcomes == ["PermissionError", "None"], f"{node}: {outcomes}, {owner_and_mode(node)}")
    return owner_and_mode(node)


def daemon_limits(_: Checks) -> str:
    """The limits of the unit are those of its control group."""
    group = Path("/sys/fs/cgroup") / show(DAEMON, "ControlGroup").lstrip("/")
    memory, tasks = ((group / name).read_text().strip() for name in ("memory.max", "pids.max"))
    used = int((group / "memory.current").read_text())
    require((memory, tasks) == (str(64 << 20), "16"), f"memory {memory}, tasks {tasks}")
    return f"{used >> 20} of {int(memory) >> 20} MiB"


def daemon_killed(_: Checks) -> str:
    """SIGKILL: started again, and the ring goes on."""
    took = restarted(DAEMON, signal.SIGKILL)
    return f"again after {took:.1f} s, {read_ring()}"


def daemon_hangs(_: Checks) -> str:
    """SIGSTOP: systemd's watchdog ends it and starts another."""
    took = restarted(DAEMON, signal.SIGSTOP)
    return f"again after {took:.1f} s, {read_ring()}"


def daemon_stopped(_: Checks) -> None:
    """Stopped: no ring is left, nor its folder."""
    command("systemctl", "stop", DAEMON)
    left = [str(path) for path in (*Path("/dev/shm").iterdir(), Path("/run/whiskerd")) if path.exists()]
    require(not left and show(DAEMON, "Result") == "success", f"left: {left}, result {show(DAEMON, 'Result')}")


def name_taken(_: Checks) -> str:
    """Another user has made a ring of the name before: the service starts, and its ring is what a reader gets."""
    taken = Path("/dev/shm") / RING
    require(as_user(NOBODY, [], lambda: taken.write_bytes(bytes(4096))) == "4096", "the name was not to be had")
    try:
        command("systemctl", "start", DAEMON)
        return read_ring(NOBODY - 1)
    finally:
        taken.unlink()
        command("systemctl", "stop", DAEMON)


def replug(checks: Checks) -> str:
    """Plugged in again, udev starts it again."""
    detach()
    attach(checks.talk.ask("usbip"))
    await_active(DAEMON)
    return read_ring()


# --------------------------------------------------------------------------------------------------------- the bases


def base_unit(port: str) -> str:
    """The unit of a base."""
    return f"whisker-base@{port}.service"


def base_socket(port: str) -> Path:
    """The socket of a base."""
    return Path("/run/whisker-base") / port / "base.sock"


@contextmanager
def base_client(port: str):
    """A function that sends a message to a base and returns the answer."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as link:
        link.connect(str(base_socket(port)))
        link.settimeout(60)

        def say(text: str) -> str:
            link.send(text.encode())
            answer = link.recv(4096).decode()
            require(not answer.startswith("error"), f"{text}: {answer}")
            return answer

        yield say


def health(port: str) -> dict[str, str]:
    """What a base reports of itself."""
    with base_client(port) as say:
        return dict(pair.split("=", 1) for pair in say("health").split()[1:])


def await_frames(port: str) -> None:
    """Until the stream of the base comes, and grows."""
    before = int(health(port)["frames"])
    await_that(lambda: int(health(port)["frames"]) > before, f"no frame from the base on {port}")


def travelled(say: Callable[[str], str]) -> float:
    """Metres driven since the client's last question."""
    return float(say("odometry").split()[1])


def drive(port: str, then: Callable[[], object]) -> object:
    """Drive until the wheels have turned, then do something with the wheels still turning; what it returned."""
    with base_client(port) as say:
        say("mode safe")
        way = 0.0

        def on() -> bool:
            nonlocal way
            say(f"drive {WHEELS_M_S} 0")
            way += travelled(say)
            return way > MOTION_M

        await_that(on, "the wheels do not turn")
        return then()


def require_still(port: str) -> None:
    """The wheels stand: hundreds of frames, no motion."""
    await_frames(port)
    with base_client(port) as say:
        travelled(say)
        first = int(health(port)["frames"])
        await_that(lambda: int(health(port)["frames"]) > first + 100, "the stream stands")
        way = travelled(say)
    require(abs(way) < STILL_M, f"the wheels turn on: {way:.3f} m in 100 frames")


def bases_start(_: Checks) -> str:
    """Two bases, each with a socket in a folder of its own."""
    with_model = Path("/etc/systemd/system/whisker-base@.service.d/model.conf")
    with_model.parent.mkdir(parents=True)
    start = next(line for line in (UNITS / "whisker-base@.service").read_text().splitlines() if "ExecStart=" in line)
    with_model.write_text(f"[Service]\nExecStart=\n{start} --model 2\n")
    command("systemctl", "daemon-reload")
    command("systemctl", "start", *map(base_unit, BASES))
    for port in BASES:
        await_active(base_unit(port))
        await_frames(port)
    return ", ".join(f"{base_socket(port)}: {owner_and_mode(base_socket(port))}" for port in BASES)


def base_ports(_: Checks) -> str:
    """The ports that are driven belong to the service's group."""
    reported = {owner_and_mode(Path("/dev") / port) for port in BASES}
    require(reported == {"root:whisker-base 0660"}, ", ".join(reported))
    return reported.pop()


def base_access(_: Checks) -> str:
    """Members of the group whisker-base may drive; others, those who may open the bridge included, may not."""

    def attempt() -> str:
        with base_client(BASES[0]) as say:
            return say("stop").split()[0]

    groups = ([], [group_of("whisker")], [group_of("whisker-base")])
    outcomes = [as_user(NOBODY, one, attempt) for one in groups]
    require(outcomes == ["PermissionError", "PermissionError", "sent"], ", ".join(outcomes))
    return "a stranger and a member of whisker refused"


def base_stops_alone(_: Checks) -> None:
    """One base stopped: its folder goes, the other's stays and answers."""
    command("systemctl", "stop", base_unit(BASES[0]))
    require(not base_socket(BASES[0]).parent.exists(), f"{base_socket(BASES[0]).parent} is left")
    await_frames(BASES[1])
    command("systemctl", "start", base_unit(BASES[0]))
    await_active(base_unit(BASES[0]))


def base_killed(_: Checks) -> str:
    """Guard and driver killed while it drives: systemd starts others, and the wheels stand."""
    took = drive(BASES[0], lambda: restarted(base_unit(BASES[0]), signal.SIGKILL))
    require_still(BASES[0])
    return f"again after {took:.1f} s"


def base_frozen(_: Checks) -> str:
    """Guard and driver frozen while it drives: systemd's watchdog ends both and starts others, and the wheels stand."""
    took = drive(BASES[0], lambda: restarted(base_unit(BASES[0]), signal.SIGSTOP))
    require_still(BASES[0])
    require(health(BASES[1])["restarts"] == "0", "the other base was disturbed")
    return f"again after {took:.1f} s"


def base_inhibits_sleep(_: Checks) -> str:
    """logind knows the delay lock of each base, though neither runs as root."""

    def locks() -> int:
        listed = command("systemd-inhibit", "--list", "--no-legend", "--no-pager").splitlines()
        return sum("whisker-base" in line and "sleep" in line and "delay" in line for line in listed)

    await_that(lambda: locks() == len(BASES), "no delay lock of each base at logind")
    return f"{locks()} locks"


def report_asleep() -> None:
    """In place of the kernel's suspend: writes down what the base says at that time."""
    reported = health(BASES[0])
    ASLEEP.write_text(f"held={reported['held']} v={reported['v_m_s']} omega={reported['omega_rad_s']}")


def base_stands_asleep(_: Checks) -> str:
    """Suspended under way, by a commander that goes on giving orders: the wheels stand first, and turn again afterwards."""
    suspend = Path("/etc/systemd/system/systemd-suspend.service.d/asleep.conf")
    suspend.parent.mkdir(parents=True)
    suspend.write_text(f"[Service]\nExecStart=\nExecStart=/usr/bin/python3 {__file__} {ASLEEP.name}\n")
    command("systemctl", "daemon-reload")
    with base_client(BASES[0]) as say:
        say("mode safe")
        with subprocess.Popen(["systemctl", "suspend"]) as suspending:
            await_that(lambda: say(f"drive {WHEELS_M_S} 0") and ASLEEP.exists(), "the machine does not sleep")
        require(suspending.returncode == 0, "systemctl suspend failed")
        reported = ASLEEP.read_text()
        require(re.fullmatch(r"held=sleep v=-?0(\.0*)? omega=-?0(\.0*)?", reported) is not None, reported)
        await_that(lambda: float(say(f"drive {WHEELS_M_S} 0").split()[2]) > 0, "the wheels stay held")
    return reported


def base_unplugged(checks: Checks) -> None:
    """Enabled for a port, a base ends when the adapter is pulled and begins when it is plugged in."""
    unit = base_unit(BASES[1])
    command("systemctl", "enable", unit)
    require(checks.talk.ask("unplug create1") == "done", "the host could not pull the adapter")
    await_that(lambda: show(unit, "ActiveState") == "inactive", f"{unit} does not end")
    require(not base_socket(BASES[1]).exists(), "its socket is left")
    require(checks.talk.ask("plug create1") == "done", "the host could not plug the adapter")
    await_active(unit)
    await_frames(BASES[1])


def bases_stop(_: Checks) -> None:
    """Both stopped on request: nothing is left."""
    command("systemctl", "stop", *map(base_unit, BASES))
    left = [str(path) for path in Path("/run/whisker-base").glob("*")]
    results = {show(base_unit(port), "Result") for port in BASES}
    require(not left and results == {"success"}, f"left {left}, results {results}")


def main() -> None:
    """All checks, the bridge's first."""
    talk = Talk()
    checks = Checks(talk)
    for check in (boots, users, verify, plug_starts_daemon, ring_place, ring_of_another_user, bridge_access):
        checks.run(f"services {check.__name__}", check)
    for check in (daemon_limits, daemon_killed, daemon_hangs, daemon_stopped, name_taken, replug):
        checks.run(f"services {check.__name__}", check)
    for check in (bases_start, base_ports, base_access, base_stops_alone, base_killed, base_frozen):
        checks.run(f"services {check.__name__}", check)
    for check in (base_inhibits_sleep, base_stands_asleep, base_unplugged, bases_stop):
        checks.run(f"services {check.__name__}", check)
    for line in command("dmesg").splitlines():
        talk.say("log", line)
    talk.say("end")


if __name__ == "__main__":
    report_asleep() if sys.argv[1:] == [ASLEEP.name] else main()
