#!/usr/bin/env python3
"""Tests that a site survives when its server's host is cut from NATS for 30 s, while agents still reach it: cluster_cut_test.py BIN WORK

Three hosts (network namespaces) have a NATS server each; host 1 has the server, host 2 the standby, host 3 a worker; a fourth has the
agents. Agents hear both servers, so this test sees which of them answers. Exit status 77: not possible on this machine.
"""

import shutil
import signal
import subprocess
import sys
import time
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SKIPPED = 77
CUT_S, LONGEST_S, QUIET_S = 30, 180, 8
SHORTEST_TENURE_S = 1
SNIFFER = """
import socket, sys, time
link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
link.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
link.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
link.bind(("239.255.76.68", 7668))
link.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton("239.255.76.68") + socket.inet_aton(sys.argv[1]))
while True:
    data, (sender, _) = link.recvfrom(65536)
    if b"LINK_DOWN_" in data[:20]:
        print(time.time(), sender, flush=True)
"""

sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "bench"))
from link_lib import hosts as network  # noqa: E402

loader = SourceFileLoader("cluster_script", str(ROOT / "scripts/cluster"))
cluster = module_from_spec(spec_from_loader("cluster_script", loader))
loader.exec_module(cluster)


class World:
    def __init__(self, hosts, folder):
        self.hosts, self.folder = hosts, folder
        addresses = [hosts.addresses[f"host{k}"] for k in (1, 2, 3)]
        run(ROOT / "packaging/pangea-nats-config", "--sites", "hall", "--hosts", *addresses, "--out", folder / "nats")
        for k, address in enumerate(addresses, 1):
            self.start(k, f"nats_{k}", "nats-server", "-c", folder / "nats" / address / "nats.conf")
        self.url = ",".join(f"tls://{address}:4222" for address in addresses)
        time.sleep(3)
        self.servers = [self.start_server(k) for k in (1, 2)]
        self.start(3, "worker", cluster.BIN / "pangea-server", "--worker", "hall", *self.access("worker"), "--logs", folder / "worker.logs")
        self.start(4, "answers", sys.executable, "-c", SNIFFER, hosts.addresses["host4"])
        for k in (1, 2):
            bus = cluster.bus_url(7700 + k)
            self.start(4, f"uplink_{k}", cluster.BIN / "pangea-uplink", "--agent", k, "--key", self.key(k), "--bus", bus,
                       "--link", network.LINK)
            time.sleep(1)
            self.start(4, f"player_{k}", cluster.BIN / "pangea-keyframe-player", "--agent", k, "--bus", bus, "--keyframes",
                       cluster.WALKS / "session.lcm")

    def start(self, k, name, *argv):
        return self.hosts[f"host{k}"].start(argv, self.folder / f"{name}.txt")

    def access(self, role):
        return "--nats", self.url, "--ca", self.folder / "nats/ca.pem", "--credentials", self.folder / f"nats/{role}-hall.credentials"

    def key(self, agent):
        return self.folder / f"agent_{agent}.key"

    def site(self, k):
        return self.folder / f"host_{k}/hall"

    def start_server(self, k):
        self.site(k).parent.mkdir()
        run(cluster.BIN / "pangea-site", "create", self.site(k), "--bus", network.OWN_BUS, "--link", network.LINK)
        for agent in (1, 2):
            if not self.key(agent).exists():
                run(cluster.BIN / "pangea-agent-handler", "keygen", "--agent", agent, "--out", self.key(agent))
            shutil.copy(self.key(agent), self.site(k) / "keys")
        self.start(k, f"logger_{k}", "lcm-logger", "--quiet", f"--lcm-url={network.OWN_BUS}", self.folder / f"bus_{k}.lcm")
        server = self.start(k, f"server_{k}", cluster.BIN / "pangea-server", "--site", self.site(k), *self.access("core"), "--replicas", 3)
        time.sleep(6 if k == 1 else 0)  # the first one gets the site
        return server

    def cut(self, is_cut):
        """Drops what host 1 sends and gets by TCP, as NATS does; the agents' link is UDP."""
        for host, device in (self.hosts.net, "host1"), (self.hosts["host1"], "eth0"):
            chain = f'  chain cut {{\n    type filter hook ingress device "{device}" priority 0\n    ip protocol tcp drop\n  }}\n'
            host.call("nft", "-f", "-", text=f"table netdev cut\ndelete table netdev cut\ntable netdev cut {{\n{chain if is_cut else ''}}}\n")

    def journal(self, k):
        return cluster.Journal(self.site(k) / "journal.lcm")

    def answers(self):
        """(time, host) of each answer to an agent."""
        number = {address: int(name[-1]) for name, address in self.hosts.addresses.items()}
        rows = [line.split() for line in (self.folder / "answers.txt").read_text().splitlines()]
        return [(float(at), number[sender]) for at, sender in rows if sender in number]


def run(*argv):
    subprocess.run([str(word) for word in argv], check=True, stdout=subprocess.DEVNULL)


def is_complete(journal, keyframes):
    return journal.keyframes == keyframes and journal.candidates == set(journal.results)


def play(world, keyframes):
    """Cuts host 1, and waits until both journals have everything and no map changes. Returns when it was cut."""
    time.sleep(10)
    world.cut(True)
    cut_at = time.time()
    time.sleep(CUT_S)
    world.cut(False)
    quiet_since = time.time()
    moves = 0
    while time.time() < min(quiet_since + QUIET_S, cut_at + LONGEST_S):
        time.sleep(1)
        before, moves = moves, sum(channel in ("MAP_STATE", "REFINEMENT", "CONSTRAINT") for k in (1, 2)
                                   for channel, _ in cluster.events(world.folder / f"bus_{k}.lcm"))
        if moves != before or not all(is_complete(world.journal(k), keyframes) for k in (1, 2)):
            quiet_since = time.time()
    return cut_at


def tenures(answers):
    """[host, first, last] of each time in which one host answered. If two did at once, some are very short."""
    found = []
    for at, k in answers:
        if found and found[-1][0] == k:
            found[-1][2] = at
        else:
            found.append([k, at, at])
    return found


def check(world, cut_at, keyframes):
    folder, found = world.folder, tenures(world.answers())
    print("s after the cut:", ", ".join(f"host {k} answered from {first - cut_at:.1f} to {last - cut_at:.1f}" for k, first, last in found))
    assert [k for k, _, _ in found[:2]] == [1, 2], "host 2 did not take over"
    assert min(last - first for _, first, last in found) > SHORTEST_TENURE_S, "two servers answered agents at once"
    for k in (1, 2):
        journal = world.journal(k)
        assert is_complete(journal, keyframes), f"journal {k}: {journal.keyframes} of {keyframes} keyframes, {len(journal.results)} results"
        assert set(journal.results.values()) == {1}, "a result is doubled"
        assert world.servers[k - 1].poll() is None, f"server {k} has ended"
    assert "another core has" in (world.site(1) / "logs/bridge.txt").read_text(), "host 1 was never told"
    core = found[-1][0]
    for k in (3 - core, core):  # the standby first: it would take over
        world.hosts[f"host{k}"].stop()
    run(cluster.BIN / "pangea-session", "report", folder / f"bus_{core}.lcm", "--out", folder / "report")
    run(cluster.BIN / "pangea-session", "replay", world.site(core) / "journal.lcm", "--out", folder / "replay")
    apart_m = max(cluster.apart_m(folder / f"report/agent_{k}.tum", folder / f"replay/agent_{k}.tum") for k in (1, 2))
    print(f"{1000 * apart_m:.3f} mm (rms) from the replay of the journal")
    assert apart_m <= cluster.MAX_APART_M


def main():
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    cluster.BIN, folder = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    if not shutil.which("nats-server") or not (cluster.BIN / "pangea-bridge").exists():
        sys.exit(SKIPPED)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    keyframes = sum(channel.startswith("KEYFRAME_") for channel, _ in cluster.events(cluster.WALKS / "session.lcm"))
    try:
        with network.Hosts([f"host{k}" for k in (1, 2, 3, 4)]) as hosts:
            hosts["host4"].lose("eth0", 0)  # needs nftables, as cut() does
            world = World(hosts, folder)
            cut_at = play(world, keyframes)
            check(world, cut_at, keyframes)
    except network.NotPermitted as why:
        print(why)
        sys.exit(SKIPPED)


if __name__ == "__main__":
    main()
