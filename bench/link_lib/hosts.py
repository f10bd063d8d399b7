"""Hosts of their own on one machine: network namespaces on a bridge, and nftables that drops packets between them.

                     net: a bridge; loses what comes in from a host's port
          ┌────────────┬──┴─────────┐
        server      agent 4      agent 5      each: eth0 with the link bus, lo with the bus of its own

A namespace lives as long as its holder, a process that sleeps: nothing is left behind, whatever happens to the bench.
Multicast with a group of its own on lo and the rest on eth0 is what the programs' default URLs are made for.
"""

import json
import os
import shutil
import signal
import subprocess
import time

OWN_BUS = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304"  # of an agent or of the server: not visible from outside
LINK = "udpm://239.255.76.68:7668?ttl=1&recv_buf_size=4194304"
HELD = ("setpriv", "--pdeathsig", "KILL", "--")  # the process ends with the bench
RANDOM_RANGE = 1000


class NotPermitted(Exception):
    """This machine has or allows no network namespaces, or no nftables in them."""


def call(argv, text=None):
    try:
        done = subprocess.run(argv, input=text, capture_output=True, text=True, check=False)
    except OSError as error:
        raise NotPermitted(f"{argv[0]}: {error.strerror}") from None
    if done.returncode != 0:
        raise NotPermitted(f"{' '.join(argv)}: {done.stderr.strip() or done.returncode}")
    return done.stdout


def chain(device, share):
    dice = "" if share == 1 else f"numgen random mod {RANDOM_RANGE} < {round(RANDOM_RANGE * share)} "
    return f"""  chain {device} {{
    type filter hook ingress device "{device}" priority 0
    ip protocol udp {dice}counter drop
  }}
"""


class Host:
    """One network namespace."""

    def __init__(self, name):
        self.name, self.running, self.rules, self.lost = name, [], {}, 0
        self.holder = subprocess.Popen([*HELD, "unshare", "--net", "--", *HELD, "sleep", "infinity"],
                                       stderr=subprocess.PIPE, text=True)
        self.net = f"/proc/{self.holder.pid}/ns/net"
        while self.holder.poll() is None and os.readlink(self.net) == os.readlink("/proc/self/ns/net"):
            time.sleep(0.01)
        if self.holder.poll() is not None:
            raise NotPermitted(self.holder.stderr.read().strip() or "unshare --net fails")

    def call(self, *argv, text=None):
        return call(["nsenter", f"--net={self.net}", "--", *argv], text)

    def start(self, argv, output):
        with open(output, "ab") as log:
            process = subprocess.Popen([*HELD, "nsenter", f"--net={self.net}", "--", *map(str, argv)],
                                       stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        self.running.append(process)
        return process

    def lose(self, device, share):
        """Drops this share of the frames that come in at the device, each at random (nftables takes no seed)."""
        self.lost = self.lost_packets()
        self.rules[device] = share
        chains = "".join(chain(device, share) for device, share in self.rules.items() if share > 0)
        self.call("nft", "-f", "-", text=f"table netdev link\ndelete table netdev link\ntable netdev link {{\n{chains}}}\n")

    def lost_packets(self):
        """Packets dropped by all rules so far; each fragment counts."""
        rules = json.loads(self.call("nft", "-j", "list", "ruleset"))["nftables"]
        parts = [part for entry in rules for part in entry.get("rule", {}).get("expr", [])]
        return self.lost + sum(part["counter"]["packets"] for part in parts if "counter" in part)

    def bytes_sent(self):
        """Bytes sent through eth0, with IP headers, without Ethernet's."""
        statistics = self.call("ip", "-j", "-s", "link", "show", "eth0")
        sent = json.loads(statistics)[0]["stats64"]["tx"]
        return sent["bytes"] - 14 * sent["packets"]

    def stop(self):
        for process in reversed(self.running):
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
                try:
                    process.wait(5)
                except subprocess.TimeoutExpired:
                    process.kill()
            process.wait()
        self.running = []

    def close(self):
        self.stop()
        self.holder.kill()
        self.holder.wait()


class Hosts:
    """The network, and the hosts on it by name; use it as a context."""

    def __init__(self, names):
        self.hosts, self.names, self.addresses = {}, names, {}

    def __enter__(self):
        try:
            self.net = self._add("net")
            self.net.call("ip", "link", "add", "bridge", "type", "bridge", "mcast_snooping", "0")
            self.net.call("ip", "link", "set", "bridge", "up")
            for number, name in enumerate(self.names, 1):
                self._plug(name, number)
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        for host in reversed(self.hosts.values()):
            host.close()

    def __getitem__(self, name):
        return self.hosts[name]

    def _add(self, name):
        self.hosts[name] = Host(name)
        return self.hosts[name]

    def _plug(self, name, number):
        host = self._add(name)
        self.net.call("ip", "link", "add", name, "type", "veth", "peer", "name", "eth0", "netns", str(host.holder.pid))
        self.net.call("ip", "link", "set", name, "master", "bridge", "up")
        for device in ("lo", "eth0"):
            host.call("ip", "link", "set", device, "up")
        self.addresses[name] = f"10.77.0.{number}"
        host.call("ip", "address", "add", f"{self.addresses[name]}/24", "dev", "eth0")
        host.call("ip", "route", "add", "239.255.76.67/32", "dev", "lo")
        host.call("ip", "route", "add", "224.0.0.0/4", "dev", "eth0")

    def lose(self, name, share):
        """Drops this share of the frames between the host and the network, in both directions."""
        self.net.lose(name, share)
        self[name].lose("eth0", share)


def check():
    """Raises NotPermitted with the reason if this machine cannot make such hosts."""
    missing = [program for program in ("unshare", "nsenter", "setpriv", "ip", "nft") if not shutil.which(program)]
    if missing:
        raise NotPermitted(f"no {', '.join(missing)} on this machine (scripts/setup scripts/packages_test.txt installs them)")
    with Hosts(["probe"]) as hosts:
        hosts.lose("probe", 0.5)
