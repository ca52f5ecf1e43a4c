"""One command in a process of its own, measured from outside.

In: a command. Out: what it printed, and what it took: wall and processor seconds, the largest resident set as the kernel
keeps it, the most anonymous memory as it was seen every few milliseconds, and how much else the machine did meanwhile.
"""

import os
import subprocess
import tempfile
import threading
import time
from pathlib import Path

# Seconds between two looks at the memory.
INTERVAL = 0.005
TICKS = os.sysconf("SC_CLK_TCK")


def run(command, environment):
    """Runs `command` to its end. Returns a dict of numbers and texts that JSON can hold."""
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as complaints:
        load, busy, begun = os.getloadavg()[0], busy_seconds(), time.perf_counter()
        child = subprocess.Popen(
            [str(word) for word in command],
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=complaints,
            env=environment,
            preexec_fn=first_to_go,
        )
        watcher = Watcher(child.pid)
        watcher.start()
        # It reaps the child, so that the watcher must know: its number may be that of another process then.
        os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)
        wall = time.perf_counter() - begun
        watcher.over.set()
        watcher.join()
        _, status, used = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        cpu = used.ru_utime + used.ru_stime
        others = max(0.0, busy_seconds() - busy - cpu) / max(wall, INTERVAL)
        texts = []
        for file in (out, complaints):
            file.seek(0)
            texts.append(file.read().decode(errors="replace"))
    return {
        "code": child.returncode,
        "output": texts[0],
        "complaint": texts[1],
        "wall": wall,
        "cpu": cpu,
        "resident": used.ru_maxrss * 1024,
        "anonymous": watcher.anonymous,
        "load": load,
        "others": others,
    }


class Watcher(threading.Thread):
    """Looks at the anonymous memory of a process until `over` is set."""

    def __init__(self, process):
        super().__init__(daemon=True)
        self.status = Path(f"/proc/{process}/status")
        self.over = threading.Event()
        self.anonymous = 0

    def run(self):
        while not self.over.wait(INTERVAL):
            for line in self.status.read_text().splitlines():
                if line.startswith("RssAnon:"):
                    self.anonymous = max(self.anonymous, int(line.split()[1]) * 1024)


def first_to_go():
    """Where memory ends, the system should take this process and not its neighbours."""
    Path("/proc/self/oom_score_adj").write_text("1000")


def busy_seconds():
    """Seconds that all processors worked for anybody, other machines on the same hardware included."""
    fields = [int(field) for field in Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:9]]
    idle, waiting = fields[3:5]
    return (sum(fields) - idle - waiting) / TICKS


def machine():
    """What was measured on."""
    values = {}
    for path in ("/proc/cpuinfo", "/proc/meminfo"):
        for line in Path(path).read_text().splitlines():
            name, _, value = line.partition(":")
            values.setdefault(name.strip(), value.strip())
    return {
        "processor": values.get("model name", "unknown"),
        "threads": len(os.sched_getaffinity(0)),
        "memory": int(values["MemTotal"].split()[0]) * 1024,
        "kernel": os.uname().release,
    }


def available_memory():
    """Bytes that a new process could have."""
    for line in Path("/proc/meminfo").read_text().splitlines():
        if line.startswith("MemAvailable:"):
            return int(line.split()[1]) * 1024
    raise OSError("/proc/meminfo does not say how much memory there is")
