"""A server started on a journal, watched until each of its processes is ready."""

import os
import shutil
import subprocess
import sys
import time

PROCESSES = ("agent_handler", "place_recognition", "inter_map_ba", "fusion", "posegraph", "global_ba", "map_points", "anchors")
READY = "ready_utime"


def url(port):
    return f"udpm://239.255.76.67:{port}?ttl=0&recv_buf_size=4194304"


def write_journal(options, site, keyframes):
    """Writes a journal. A journal of fewer keyframes, in whole visits, is the beginning of a longer one."""
    subprocess.run([options.build.resolve() / "bin/pangea-restart-journal", options.log, "--out", site / "journal.lcm",
                    "--keyframes", str(keyframes)], check=True)


def make_site(options, name):
    """A new site without a journal."""
    site = options.work.resolve() / str(name)
    shutil.rmtree(site, ignore_errors=True)
    subprocess.run([options.build.resolve() / "bin/pangea-site", "create", site, "--bus", url(options.port),
                    "--link", url(options.port + 1)], check=True, stdout=subprocess.DEVNULL)
    return site


def watch(bus, status_type, begin, timeout_s, rest_s):
    """The newest status of each process, until `rest_s` after all are ready, or until the timeout."""
    newest = {}
    bus.subscribe("STATUS_.*", lambda channel, status: newest.__setitem__(status.process, status), status_type)
    ready = None
    while time.time() < begin + timeout_s and (ready is None or time.time() < ready + rest_s):
        bus.handle(0.1)
        if ready is None and all(name in newest and ready_utime(newest[name]) for name in PROCESSES):
            ready = time.time()
    return newest


def ready_utime(status):
    return next((counter.count for counter in status.counters if counter.name == READY), None)


def metrics(status, begin):
    ready = status and ready_utime(status)
    return {"ready_s": None if not ready else 1e-6 * ready - begin, "cpu_s": status.cpu_s if status else 0,
            "memory_mb": status.memory_mb if status else 0}


def start(options, site):
    """Metrics of each process of a server on the site, from its start until all are ready."""
    sys.path.insert(0, os.fspath(options.build.resolve() / "python"))
    from pangea import status_t
    from pangea.bus import Bus
    bus = Bus(url(options.port))
    begin = time.time()
    server = subprocess.Popen([options.build.resolve() / "bin/pangea-server", "--site", site], stdout=subprocess.DEVNULL)
    try:
        newest = watch(bus, status_t, begin, options.timeout, options.rest)
    finally:
        server.terminate()
        server.wait()
        bus.close()
    return {name: metrics(newest.get(name), begin) for name in PROCESSES}


def measure(options, keyframes):
    """{keyframes, start, processes: {name: metrics}} for each start."""
    site = make_site(options, keyframes)
    write_journal(options, site, keyframes)
    for number in range(1, options.starts + 1 + (options.later > 0)):
        if number > options.starts:
            keyframes += options.later
            write_journal(options, site, keyframes)
        yield {"keyframes": keyframes, "start": number, "journal_mb": 1e-6 * (site / "journal.lcm").stat().st_size,
               "processes": start(options, site)}
