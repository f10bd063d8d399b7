"""Real processes: for each agent a player and an uplink, for each site a server and a worker, and three NATS servers for all."""

import os
import shutil
import subprocess
import sys
import time
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path

from many_agents_lib.run import copy_for, resident_kb

ROOT = Path(__file__).resolve().parents[2]
STEP_S = 1.0

loader = SourceFileLoader("cluster_script", str(ROOT / "scripts/cluster"))
cluster = module_from_spec(spec_from_loader("cluster_script", loader))
loader.exec_module(cluster)


def cpu_seconds(process):
    user, system = (process / "stat").read_text().rsplit(")", 1)[1].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def role_of(process):
    """A bridge's role, with a blank before it; empty for others."""
    words = (process / "cmdline").read_text().split("\0")
    return f" {words[words.index('--role') + 1]}" if "--role" in words else ""


class Site:
    def __init__(self, run, number):
        self.name = f"site_{number + 1}"
        self.folder = run.work / self.name
        agents = run.options.agents
        self.port = run.options.port + (3 + agents) * number  # server bus, link bus, worker's bus, and one for each agent
        self.agents = range(agents * number + 1, agents * (number + 1) + 1)

    def bus(self):
        return cluster.bus_url(self.port)

    def link(self):
        return cluster.bus_url(self.port + 1)

    def worker_bus_port(self):
        return self.port + 2

    def agent_bus(self, agent):
        return cluster.bus_url(self.port + 3 + agent - self.agents[0])


class Run:
    def __init__(self, options):
        self.options = options
        self.work = options.work.resolve()
        self.bin = options.build.resolve() / "bin"
        self.memory_kb = {}  # process name: largest resident memory of each process, by its id
        self.cpu_s = {}  # the same for its CPU time
        self.took_s = 0
        cluster.BIN = self.bin

    def program(self, name, *words):
        subprocess.run([str(word) for word in (self.bin / name, *words)], check=True, stdout=subprocess.DEVNULL)

    def record_walks(self):
        """Records a keyframe log for each agent of a site; the logs are kept between runs."""
        self.walks = []
        for walk in range(1, self.options.agents + 1):
            log = self.work / f"walks/{walk}.lcm"
            self.walks.append(log)
            if not log.exists():
                print(f"walk {walk} of {self.options.agents}", flush=True)
                shutil.rmtree(self.work / "walks/recording", ignore_errors=True)
                self.program("pangea-sim", "--no-cache", "--shrink", 2, "--duration", self.options.seconds, "--path-seed", walk,
                             "--seed", walk, "--out", self.work / "walks/recording")
                self.program("pangea-vio", "--agent", walk, "--bus", "none", "--rate", "max", "--recording",
                             self.work / "walks/recording", "--out-keyframes", log.with_suffix(".part"))
                log.with_suffix(".part").rename(log)

    def prepare(self):
        (self.work / "walks").mkdir(parents=True, exist_ok=True)
        self.record_walks()
        self.sites = [Site(self, number) for number in range(self.options.sites)]
        for folder in (self.work / "logs", *(site.folder for site in self.sites)):
            shutil.rmtree(folder, ignore_errors=True)
        (self.work / "logs").mkdir()
        for site in self.sites:
            self.program("pangea-site", "create", site.folder, "--bus", site.bus(), "--link", site.link())
            for walk, agent in zip(self.walks, site.agents):
                copy_for(agent, walk, self.work / f"logs/walk_{agent}.lcm")
                self.program("pangea-agent-handler", "keygen", "--agent", agent, "--out", site.folder / f"keys/agent_{agent}.key")

    def start_site(self, processes, nats, site):
        processes.start(f"log_{site.name}", "lcm-logger", "--quiet", f"--lcm-url={site.bus()}", "--channel=MAP_STATE|CONSTRAINT",
                        self.work / f"logs/{site.name}.lcm")
        cluster.start_server(processes, site.name, nats, site.folder)
        cluster.start_workers(processes, nats, site.name, 1, site.worker_bus_port())
        processes.running[f"worker_{site.name}"] = processes.running.pop("worker_1")

    def start_uplink(self, processes, site, agent):
        bus = site.agent_bus(agent)
        processes.start(f"log_{agent}", "lcm-logger", "--quiet", f"--lcm-url={bus}", "--channel=KEYFRAME_.*|CORRECTION_.*",
                        self.work / f"logs/agent_{agent}.lcm")
        processes.start(f"uplink_{agent}", self.bin / "pangea-uplink", "--agent", agent, "--key",
                        site.folder / f"keys/agent_{agent}.key", "--bus", bus, "--link", site.link())

    def start_player(self, processes, site, agent):
        processes.start(f"player_{agent}", self.bin / "pangea-keyframe-player", "--agent", agent, "--bus", site.agent_bus(agent),
                        "--keyframes", self.work / f"logs/walk_{agent}.lcm", "--rate", self.options.rate)

    def sample_processes(self):
        """The largest memory and CPU time of each process so far, by the program's name."""
        for entry in Path("/proc").iterdir():
            if entry.name.isdigit():
                try:
                    program = Path(os.readlink(entry / "exe"))
                    kb, cpu_s = resident_kb(int(entry.name)), cpu_seconds(entry)
                    name = program.name + role_of(entry)
                except OSError:  # the process has ended
                    continue
                if program.parent == self.bin or program.name == "nats-server":
                    for largest, now in (self.memory_kb, kb), (self.cpu_s, cpu_s):
                        of_program = largest.setdefault(name, {})
                        of_program[entry.name] = max(now, of_program.get(entry.name, 0))

    def maps_bytes(self):
        return sum((self.work / f"logs/{site.name}.lcm").stat().st_size for site in self.sites)

    def wait(self, processes):
        """Waits until all is played and no map has changed for a while."""
        begin = quiet_since = time.monotonic()
        size = -1
        while time.monotonic() - quiet_since < self.options.quiet:
            time.sleep(STEP_S)
            self.sample_processes()
            playing = sum(name.startswith("player_") and process.poll() is None for name, process in processes.running.items())
            if playing or self.maps_bytes() != size:
                quiet_since, size = time.monotonic(), self.maps_bytes()
            print(f"\r{time.monotonic() - begin:5.0f} s: {playing} agents walk, maps said {1e-6 * max(size, 0):.0f} MB  ",
                  end="", file=sys.stderr, flush=True)
        print(file=sys.stderr)
        self.took_s = quiet_since - begin

    def play(self):
        self.prepare()
        processes = cluster.Processes(self.work / "logs")
        try:
            nats = cluster.Nats(processes, 3, *(site.name for site in self.sites))
            for site in self.sites:
                self.start_site(processes, nats, site)
            time.sleep(5)
            agents = [(site, agent) for site in self.sites for agent in site.agents]
            for start in (self.start_uplink, self.start_player):
                for site, agent in agents:
                    start(processes, site, agent)
                time.sleep(5)
            self.wait(processes)
        finally:
            processes.stop()

    def expected_groups(self):
        """The groups of one site's agents, according to one server on the site's journal."""
        out = self.work / "replay"
        self.program("pangea-session", "replay", self.sites[0].folder / "journal.lcm", "--out", out)
        return cluster.groups(out)
