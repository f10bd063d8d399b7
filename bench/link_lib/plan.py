"""The sessions that are run: one for each row of the table; they differ only in the link."""

import json
import sys
from dataclasses import dataclass
from pathlib import Path

from accuracy_lib.jobs import OUT, Command, Job

# One factor at a time, for both directions of every agent's link, or for every agent's budget. The others are compared with the first one.
ROWS = {
    "perfect": "",
    "loss_1": "loss: 0.01",
    "loss_5": "loss: 0.05",
    "loss_10": "loss: 0.1",
    "loss_20": "loss: 0.2",
    "delay_50": "delay_ms: 50",
    "delay_500": "delay_ms: 500",
    "delay_2000": "delay_ms: 2000",
    "loss_20_delay_2000": "loss: 0.2, delay_ms: 2000",
    "jitter_50": "delay_ms: 50, jitter_ms: 50",
    "reorder_5": "reorder: 0.05",
    "duplicate_5": "duplicate: 0.05",
    "partition_60": "partitions: [{at: 30, seconds: 60}]",
    "budget_40": "uplink: {budget_kb_per_s: 40}",
    "budget_20": "uplink: {budget_kb_per_s: 20}",
    "budget_10": "uplink: {budget_kb_per_s: 10}",
    "forged": "",
}
# The same with hosts of their own (hosts.py): nftables drops frames and cuts links, an emulator on the agent's host does the rest.
HOST_ROWS = {
    "perfect": {},
    "loss_1": {"loss": 0.01},
    "loss_5": {"loss": 0.05},
    "loss_10": {"loss": 0.1},
    "loss_20": {"loss": 0.2},
    "delay_500": {"emulator": "delay_ms: 500"},
    "jitter_50": {"emulator": "delay_ms: 50, jitter_ms: 50"},
    "reorder_5": {"emulator": "reorder: 0.05"},
    "duplicate_5": {"emulator": "duplicate: 0.05"},
    "partition_60": {"partition": [30, 60]},
    "strangers": {"strangers": 100_000},
    "packets_4096": {"packet_bytes": 4096},
    "packets_4096_loss_5": {"packet_bytes": 4096, "loss": 0.05},
}
NO_FAULT = {"loss": 0, "emulator": "", "partition": None, "packet_bytes": None, "strangers": 0}
FORGED_PACKETS = 1_000_000  # in that row, on the server's link bus
SECOND_STARTS_AFTER_S = 2  # so that the same map is the first in every journal


@dataclass
class Agent:
    id: int
    keyframes: Path
    recording: Path = None  # for its ground truth


def is_budget(conditions):
    return conditions.startswith("uplink: {budget")


def session_yaml(options, conditions):
    lines = ["agents:"]
    for index, agent in enumerate(options.agents):
        seed = f"seed: {agent.id}"
        keys = [f"id: {agent.id}", f"keyframes: {agent.keyframes.resolve()}", f"delay: {SECOND_STARTS_AFTER_S * index}"]
        keys += [f"recording: {agent.recording.resolve()}"] if agent.recording else []
        keys += [f"duration: {options.seconds:g}"] if options.seconds else []
        if is_budget(conditions):
            keys += [conditions, f"link: {{{seed}}}"]
        else:
            keys.append(f"link: {{{', '.join(filter(None, [conditions, seed]))}}}")
        lines.append(f"  - {{{', '.join(keys)}}}")
    return "\n".join(lines) + "\n"


def bus(port):
    """URLs as pangea-session makes them: the server's, its link, the agents', the agents' links, from --port upwards."""
    return f"udpm://239.255.76.67:{port}?ttl=0&recv_buf_size=4194304"


def forger(options, run):
    """Floods the server's link bus while `run` runs; it overhears the packets that it repeats and changes on the agents' ends."""
    agents = len(options.agents)
    seconds = options.seconds or 100
    overheard = [word for k in range(agents) for word in ("--overhear", bus(options.port + 2 + agents + k))]
    return [str(Path(options.bin).resolve() / "pangea-link-forger"), "--link", bus(options.port + 1), *overheard,
            "--agents", *[str(agent.id) for agent in options.agents], "--packets", str(FORGED_PACKETS),
            "--packets-per-s", f"{FORGED_PACKETS / seconds:.0f}", "--", *run, "--port", str(options.port)]


def host_row(options, name):
    agents = [{"id": agent.id, "keyframes": str(agent.keyframes.resolve()),
               "recording": str(agent.recording.resolve()) if agent.recording else ""} for agent in options.agents]
    return json.dumps(NO_FAULT | HOST_ROWS[name] | {
        "agents": agents, "bin": str(Path(options.bin).resolve()), "seconds": options.seconds})


def jobs_of(options, work):
    program = Path(options.bin).resolve() / "pangea-session"
    outside = [agent.keyframes.resolve() for agent in options.agents]
    jobs = []
    for name in options.rows:
        if options.hosts:
            runner = Path(__file__).resolve().parent / "hosts_session.py"
            command = Command([sys.executable, str(runner), f"{OUT}/row.json", f"{OUT}/session"])
            files = {"row.json": host_row(options, name)}
        else:
            run = [str(program), "run", f"{OUT}/session.yaml", "--out", f"{OUT}/session"]
            command = Command(forger(options, run) if name == "forged" else run)
            files = {"session.yaml": session_yaml(options, ROWS[name])}
        jobs.append(Job("link", name, work / name, [command], outside=outside, files=files))
    return jobs


def label(options, name):
    """The label of a row, for people."""
    if not options.hosts:
        return ROWS[name] or name
    return ", ".join(f"{key}: {value}" if key != "emulator" else value for key, value in HOST_ROWS[name].items()) or name
