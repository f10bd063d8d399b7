"""Hours without a server: the uplink spools to disk, is killed, and delivers everything when the server is back."""

import os
import shutil
import signal
import struct
import subprocess
import time
from collections import Counter

from faults_lib.checks import Row, print_rows
from faults_lib.session import whole_keyframes
from link_lib.metrics import LCM_SYNC

OFFLINE_KEYFRAMES = 5000  # a walk of an hour
PLAYED_PER_S = 100
CATCH_UP_TIMEOUT_S = 600


def copies(log, agent, count, out):
    """{id: encoded bytes} of `count` keyframes of one agent: the stored ones repeated in ascending maps; writes them to `out`."""
    stored = [(id, bytearray(data)) for id, _, data in whole_keyframes(log) if id[0] == agent]
    made = {}
    with open(out, "wb") as file:
        for number in range(count):
            copy, (_, data) = number // len(stored), stored[number % len(stored)]
            struct.pack_into(">q", data, 12, 1000 + copy)  # opened_utime of the map
            struct.pack_into(">q", data, 24, int(1e6 * number / PLAYED_PER_S))  # utime
            channel = f"KEYFRAME_{agent}".encode()
            file.write(struct.pack(">IqqII", LCM_SYNC, number, 0, len(channel), len(data)) + channel + data)
            made[struct.unpack_from(">8xiqi", data)] = bytes(data)
    return made


def memory_mb(process):
    pages = int(open(f"/proc/{process.pid}/statm").read().split()[1])
    return 1e-6 * pages * os.sysconf("SC_PAGESIZE")


class Link:
    """One agent's processes and a handler, started and stopped by the test."""

    def __init__(self, folder, bin, agent):
        shutil.rmtree(folder, ignore_errors=True)
        (folder / "keys").mkdir(parents=True)
        self.folder, self.bin, self.agent, self.running = folder, bin, agent, []
        self.key = folder / "keys" / f"agent_{agent}.key"
        port = 20000 + os.getpid() % 10000
        self.bus, self.link, self.server = (f"udpm://239.255.76.67:{port + i}?ttl=0&recv_buf_size=4194304"
                                            for i in range(3))
        self.call("pangea-agent-handler", "keygen", "--agent", str(agent), "--out", str(self.key)).wait()

    def call(self, program, *arguments):
        with open(self.folder / f"{program}.txt", "a") as output:
            process = subprocess.Popen([str(self.bin / program), *arguments], stdout=output, stderr=output)
        self.running.append(process)
        return process

    def uplink(self):
        return self.call("pangea-uplink", "--agent", str(self.agent), "--bus", self.bus, "--link", self.link, "--key",
                         str(self.key), "--spool", str(self.folder / "spool"))

    def player(self, log):
        return self.call("pangea-keyframe-player", "--agent", str(self.agent), "--bus", self.bus, "--keyframes", str(log))

    def handler(self):
        return self.call("pangea-agent-handler", "--link", self.link, "--bus", self.server, "--keys",
                         str(self.key.parent), "--journal", str(self.folder / "journal.lcm"))

    def stop(self):
        for process in self.running:
            if process.poll() is None:
                process.kill()
            process.wait()


def spooled(folder):
    kept = {}
    for file in sorted((folder / "spool").glob("*.lcm")):
        kept.update({id: data for id, _, data in whole_keyframes(file)})
    return kept


def run(options):
    agent = options.agents[0]
    link = Link(options.work / "spool", options.bin, agent.id)
    log = link.folder / "stored.lcm"
    made = copies(agent.log, agent.id, OFFLINE_KEYFRAMES, log)
    newest = max(opened for _, opened, _ in made)
    try:
        uplink, player = link.uplink(), link.player(log)
        kills = 0
        memory = []
        while player.poll() is None and len(memory) < OFFLINE_KEYFRAMES / PLAYED_PER_S + 5:
            time.sleep(1)
            memory.append(memory_mb(uplink))
            if len(memory) % 10 == 0:
                uplink.send_signal(signal.SIGKILL)
                uplink.wait()
                uplink, kills = link.uplink(), kills + 1
        # From now on only the uplink's spool has them.
        player.kill()
        player.wait()
        uplink.kill()
        uplink.wait()
        kept = spooled(link.folder)
        rows = [Row("keyframes spooled without a server", f"{len(kept)} of {len(made)}, {kills} uplinks killed",
                    kept == made),
                Row("memory of the uplink meanwhile, MB, at most", f"{max(memory):.0f}", max(memory) < 60)]
        uplink, handler, begin = link.uplink(), link.handler(), time.time()
        seen, newest_s, journal = Counter(), None, link.folder / "journal.lcm"
        while len(seen) < len(made) and time.time() - begin < CATCH_UP_TIMEOUT_S:
            time.sleep(1)
            seen = Counter(id for id, _, _ in whole_keyframes(journal)) if journal.exists() else seen
            if newest_s is None and all(id in seen for id in made if id[1] == newest):
                newest_s = time.time() - begin
        taken_s = time.time() - begin
        time.sleep(2)
        left = len(spooled(link.folder))
        delivered = {id: data for id, _, data in whole_keyframes(journal)}
        order = [id for id, _, _ in whole_keyframes(journal)]
        in_order = all(order[i][2] == order[i - 1][2] + 1 for i in range(1, len(order)) if order[i][1] == order[i - 1][1])
        size = 1e-6 * sum(map(len, made.values()))
        rows += [
            Row("delivered when the server is there", f"{len(delivered)} of {len(made)} in {taken_s:.0f} s ({size:.0f} MB)",
                delivered == made and max(seen.values()) == 1),
            Row("each map in order", "yes" if in_order else "no", in_order),
            Row("the newest map was there after, s", f"{newest_s or float('inf'):.0f}",
                newest_s is not None and newest_s < 0.3 * taken_s + 3),
            Row("memory of the uplink while it caught up, MB", f"{memory_mb(uplink):.0f}", memory_mb(uplink) < 60),
            Row("left in the spool", str(left), left < 100),
        ]
        return print_rows(f"{OFFLINE_KEYFRAMES} keyframes (an hour) without a server", rows)
    finally:
        link.stop()
