#!/usr/bin/env python3
"""One row of bench/link --hosts: a session whose server and agents are hosts of their own (hosts.py).

    hosts_session.py ROW.json OUT      writes into OUT the same files as pangea-session run
"""

import json
import subprocess
import sys
import time
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from link_lib.metrics import decode_status, events  # noqa: E402
from link_lib.hosts import LINK, OWN_BUS, Hosts  # noqa: E402
from link_lib.plan import SECOND_STARTS_AFTER_S  # noqa: E402

SERVER = ("place-recognition", "inter-map-ba", "fusion", "posegraph", "global-ba", "map-points", "anchors")
WORK = ("KEYFRAME_", "PLACE_MATCH", "AGAIN_", "CONSTRAINT", "MAP_STATE")
OWN_LINK = OWN_BUS.replace(":7667", ":7669")  # between an uplink and its link emulator
START_TIMEOUT_S, DRAIN_TIMEOUT_S, QUIET_S, FRESH_S, STEP_S = 30, 300, 2.5, 3, 0.2
STRANGER_S = 60  # duration of its messages


class Watch:
    """Reads the growing logs of a session: which processes have work left, and since when nothing has happened."""

    def __init__(self):
        self.read, self.statuses, self.last_work_us = {}, {}, 1e6 * time.time()

    def look(self):
        for log in list(self.read):
            for utime, channel, data in events(log, self.read[log]) if log.exists() else ():
                self.read[log] += 28 + len(channel) + len(data)
                if channel.startswith(WORK):
                    self.last_work_us = max(utime, self.last_work_us)
                elif channel.startswith("STATUS_"):
                    self.statuses[channel] = (utime, decode_status(data)["pending"])

    def idle(self, processes, quiet_s):
        self.look()
        now = 1e6 * time.time()
        said = [self.statuses.get(f"STATUS_{name}", (0, 1)) for name in processes]
        return now - self.last_work_us >= 1e6 * quiet_s and all(
            now - utime < 1e6 * FRESH_S and pending == 0 for utime, pending in said)


class Session:
    def __init__(self, row, out, hosts):
        self.row, self.out, self.hosts, self.watch = row, out, hosts, Watch()
        self.processes = ["agent_handler", *(name.replace("-", "_") for name in SERVER)]
        for folder in ("logs", "keys"):
            (out / folder).mkdir(parents=True)
        recordings = [{"id": a["id"], "recording": a["recording"], "start": 0, "duration": row["seconds"] or 0} for a in row["agents"]]
        (out / "recordings.json").write_text(json.dumps({"agents": recordings}))

    def program(self, name):
        return Path(self.row["bin"]) / f"pangea-{name}"

    def start(self, host, name, *argv):
        return self.hosts[host].start(argv, self.out / "logs" / f"{name}.txt")

    def log_bus(self, host, log):
        self.start(host, f"logger_{log}", "lcm-logger", "--quiet", f"--lcm-url={OWN_BUS}", self.out / f"{log}.lcm")
        self.watch.read[self.out / f"{log}.lcm"] = 0

    def start_server(self):
        if self.row["strangers"]:  # like a machine without its own multicast route for the bus, which other hosts' multicast reaches
            self.hosts["server"].call("ip", "route", "replace", "239.255.76.67/32", "dev", "eth0")
        for agent in self.row["agents"]:
            subprocess.run([self.program("agent-handler"), "keygen", "--agent", str(agent["id"]), "--out",
                            self.out / "keys" / f"agent_{agent['id']}.key"], check=True, stdout=subprocess.DEVNULL)
        self.log_bus("server", "session")
        self.start("server", "agent_handler", self.program("agent-handler"), "--link", LINK, "--bus", OWN_BUS, "--journal",
                   self.out / "journal.lcm", "--keys", self.out / "keys")
        for name in SERVER:
            self.start("server", name, self.program(name), "--bus", OWN_BUS)
        self.wait(0, START_TIMEOUT_S, "the server processes did not come up")

    def start_agent(self, agent):
        id, host, link = agent["id"], f"agent_{agent['id']}", LINK
        self.hosts.lose(host, self.row["loss"])
        self.log_bus(host, host)
        if self.row["emulator"]:
            link, options = OWN_LINK, self.out / "logs" / f"emulator_{id}.yaml"
            options.write_text("".join(f"{part.strip()}\n" for part in [*self.row["emulator"].split(","), f"seed: {id}"]))
            self.start(host, f"link_emulator_{id}", self.program("link-emulator"), "--agent", id, "--agent-link", OWN_LINK,
                       "--server-link", LINK, "--bus", OWN_BUS, "--options", options)
        uplink = self.out / "logs" / f"uplink_{id}.yaml"
        uplink.write_text(f"packet_bytes: {self.row['packet_bytes']}\n" if self.row["packet_bytes"] else "{}\n")
        self.start(host, f"uplink_{id}", self.program("uplink"), "--agent", id, "--bus", OWN_BUS, "--link", link, "--key",
                   self.out / "keys" / f"{host}.key", "--spool", self.out / f"spool_{id}", "--options", uplink)
        self.processes.append(f"uplink_{id}")
        duration = ["--duration", self.row["seconds"]] if self.row["seconds"] else []
        return self.start(host, f"keyframes_{id}", self.program("keyframe-player"), "--agent", id, "--bus", OWN_BUS,
                          "--keyframes", agent["keyframes"], *duration)

    def start_stranger(self):
        """The stranger runs while the agents play; no process may accept its messages to the server's own bus."""
        addresses, rate = self.hosts.addresses, self.row["strangers"] / (self.row["seconds"] or STRANGER_S)
        self.hosts["stranger"].start([sys.executable, Path(__file__).parent / "stranger.py", addresses["stranger"],
                                      addresses["server"], self.row["strangers"], rate], self.out / "logs" / "stranger.txt")

    def cut(self, share):
        for agent in self.row["agents"]:
            self.hosts.lose(f"agent_{agent['id']}", share)

    def play(self):
        begin, players = time.time(), []
        if self.row["strangers"]:
            self.start_stranger()
        steps = [(SECOND_STARTS_AFTER_S * i, lambda a=agent: players.append(self.start_agent(a)))
                 for i, agent in enumerate(self.row["agents"])]
        if self.row["partition"]:
            at, seconds = self.row["partition"]
            steps += [(at, lambda: self.cut(1)), (at + seconds, lambda: self.cut(self.row["loss"]))]
        while steps or any(player.poll() is None for player in players):
            while steps and time.time() - begin >= steps[0][0]:
                steps.pop(0)[1]()
            time.sleep(STEP_S)
        if any(player.returncode != 0 for player in players):
            raise SystemExit(f"a player of keyframes failed: see {self.out}/logs")

    def wait(self, quiet_s, timeout_s, otherwise):
        end = time.time() + timeout_s
        while not self.watch.idle(self.processes, quiet_s):
            if time.time() > end:
                raise SystemExit(f"{otherwise} within {timeout_s} s: {self.watch.statuses}; see {self.out}/logs")
            time.sleep(STEP_S)

    def run(self):
        self.start_server()
        self.play()
        self.wait(QUIET_S, DRAIN_TIMEOUT_S, "the session did not become idle")
        agents = [self.hosts[f"agent_{agent['id']}"] for agent in self.row["agents"]]
        counted = {"frame_bytes_up": sum(host.bytes_sent() for host in agents),
                   "frames_lost_up": self.hosts.net.lost_packets(),
                   "frames_lost_down": sum(host.lost_packets() for host in agents)}
        (self.out / "frames.json").write_text(json.dumps(counted) + "\n")


def main():
    row, out = json.loads(Path(sys.argv[1]).read_text()), Path(sys.argv[2])
    with Hosts(["server", *(f"agent_{agent['id']}" for agent in row["agents"]), "stranger"]) as hosts:
        session = Session(row, out, hosts)
        session.run()
    report = out / "report"
    subprocess.run([session.program("session"), "report", out / "session.lcm", "--out", report], check=True, stdout=subprocess.DEVNULL)
    (report / "report.json").rename(out / "report.json")


if __name__ == "__main__":
    main()
