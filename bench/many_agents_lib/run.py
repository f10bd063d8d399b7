"""Real processes: one agent_handler, and for each agent a player, an uplink and a logger of its bus."""

import shutil
import signal
import struct
import subprocess
import time

from link_lib.metrics import LCM_SYNC, events

AGENT_ID_AT = 8  # in a keyframe's bytes, after the type's fingerprint
STEP_S = 0.2
MAX_WAIT_S = 60  # at the end, for delayed keyframes


def copy_for(agent, log, out):
    """Copies the log's keyframes as those of another agent."""
    with open(out, "wb") as file:
        for number, (utime, channel, data) in enumerate(events(log)):
            if channel.startswith("KEYFRAME_"):
                name = f"KEYFRAME_{agent}".encode()
                data = data[:AGENT_ID_AT] + struct.pack(">i", agent) + data[AGENT_ID_AT + 4:]
                file.write(struct.pack(">IqqII", LCM_SYNC, number, utime, len(name), len(data)) + name + data)


def resident_kb(pid):
    with open(f"/proc/{pid}/status") as file:
        return next((int(line.split()[1]) for line in file if line.startswith("VmRSS")), 0)


class Run:
    def __init__(self, options):
        self.options = options
        self.work = options.work.resolve()
        self.stopped = 2 if options.trouble_at else None
        self.killed = options.agents if options.trouble_at else None
        self.ids = range(1, options.agents + 1)
        self.memory = []  # (wall clock s, agents running, resident kB of the handler, of each uplink)
        self.trouble = None  # wall clock, microseconds: begin and end
        self.processes = {}

    def url(self, number):
        return f"udpm://239.255.76.67:{self.options.port + number}?ttl=0&recv_buf_size=4194304"

    def start(self, name, *argv):
        with open(self.work / "logs" / name, "wb") as log:
            self.processes[name] = subprocess.Popen([str(word) for word in argv], stdout=log, stderr=log)

    def program(self, name):
        return self.options.bin.resolve() / name

    def log_bus(self, name, url):
        (self.work / f"{name}.lcm").unlink(missing_ok=True)
        self.start(f"logger_{name}", "lcm-logger", "--quiet", f"--lcm-url={url}", self.work / f"{name}.lcm")

    def prepare(self):
        for folder in ("logs", "keys", "keyframes"):
            shutil.rmtree(self.work / folder, ignore_errors=True)
            (self.work / folder).mkdir()
        (self.work / "journal.lcm").unlink(missing_ok=True)
        for id in self.ids:
            logs = self.options.keyframes
            copy_for(id, logs[(id - 1) % len(logs)], self.work / "keyframes" / f"agent_{id}.lcm")
            subprocess.run([self.program("pangea-agent-handler"), "keygen", "--agent", str(id), "--out",
                            self.work / "keys" / f"agent_{id}.key"], check=True, stdout=subprocess.DEVNULL)

    def join(self, id):
        bus = self.url(1 + id)
        self.log_bus(f"agent_{id}", bus)
        self.start(f"uplink_{id}", self.program("pangea-uplink"), "--agent", id, "--bus", bus, "--link", self.url(1),
                   "--key", self.work / "keys" / f"agent_{id}.key")
        self.start(f"player_{id}", self.program("pangea-keyframe-player"), "--agent", id, "--bus", bus, "--keyframes",
                   self.work / "keyframes" / f"agent_{id}.lcm", "--duration", self.options.seconds)

    def sample_memory(self):
        uplinks = [id for id in self.ids if self.alive(f"uplink_{id}")]
        self.memory.append((time.time(), len(uplinks), resident_kb(self.processes["handler"].pid),
                            [resident_kb(self.processes[f"uplink_{id}"].pid) for id in uplinks]))

    def alive(self, name):
        return name in self.processes and self.processes[name].poll() is None

    def send(self, name, number):
        if self.alive(name):
            self.processes[name].send_signal(number)

    def make_trouble(self, since_joined):
        """Stops and kills once, and continues the stopped uplink."""
        now = int(1e6 * time.time())
        if self.trouble is None and since_joined >= self.options.trouble_at:
            self.trouble = [now, None]
            self.send(f"uplink_{self.stopped}", signal.SIGSTOP)
            for name in (f"uplink_{self.killed}", f"player_{self.killed}"):
                self.send(name, signal.SIGKILL)
        elif self.trouble and not self.trouble[1] and now - self.trouble[0] >= 1e6 * self.options.stopped_for:
            self.trouble[1] = now
            self.send(f"uplink_{self.stopped}", signal.SIGCONT)

    def play(self):
        self.prepare()
        try:
            self.log_bus("server", self.url(0))
            self.start("handler", self.program("pangea-agent-handler"), "--link", self.url(1), "--bus", self.url(0),
                       "--journal", self.work / "journal.lcm", "--keys", self.work / "keys")
            time.sleep(0.5)
            begin, waiting = time.time(), list(self.ids)
            joined = begin + self.options.join_every * (len(waiting) - 1)
            end = joined + self.options.seconds + MAX_WAIT_S
            while time.time() < end and (waiting or any(self.alive(f"player_{id}") for id in self.ids)):
                while waiting and time.time() - begin >= self.options.join_every * (len(self.ids) - len(waiting)):
                    self.join(waiting.pop(0))
                if self.options.trouble_at:
                    self.make_trouble(time.time() - joined)
                self.sample_memory()
                time.sleep(STEP_S)
            time.sleep(1.5)  # for the last status
        finally:
            for process in self.processes.values():
                if process.poll() is None:
                    process.send_signal(signal.SIGCONT)
                    process.terminate()
            for process in self.processes.values():
                process.wait()
