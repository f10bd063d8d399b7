"""The scenarios: each runs its session and returns whether all its claims hold; None if it cannot run here."""

import shutil
from collections import Counter
from pathlib import Path

from faults_lib import memory, offline, sanitized
from faults_lib.checks import Row, all_acknowledged, delivery, kills, print_rows, replays, same_map
from faults_lib.session import SECOND_STARTS_AFTER_S, Agent, Session, random_kills, whole_keyframes


def length_s(options):
    """Length of the session: until its last agent has ended."""
    ends = []
    for index, agent in enumerate(options.agents):
        times = [own for id, own, _ in whole_keyframes(agent.log) if id[0] == agent.id]
        played = 1e-6 * (max(times) - min(times))
        ends.append(SECOND_STARTS_AFTER_S * index + min(played, options.seconds or played))
    return max(ends)


def session(options, name, faults=(), **more):
    folder = options.work / name
    shutil.rmtree(folder, ignore_errors=True)
    return Session(folder, options.bin, options.agents, faults, options.seconds, **more)


def calm(options):
    """The undisturbed session; it is run only once."""
    if not hasattr(options, "calm"):
        options.calm = session(options, "calm").run()
        if options.calm.exit_code != 0:
            raise SystemExit(f"the undisturbed session failed: see {options.calm.folder}/session.txt")
    return options.calm


def compare(options, disturbed, planned):
    undisturbed = calm(options)
    ended = [Row("the session's exit code", str(disturbed.exit_code), disturbed.exit_code == 0)]
    if disturbed.exit_code != 0:
        return ended
    return (ended + kills(disturbed, planned) + delivery(disturbed, options.agents, options.seconds) +
            same_map(disturbed, undisturbed) + replays(disturbed, undisturbed, options.agents))


def run_kills(options):
    planned = random_kills(options.seed, options.kills, 1, length_s(options), options.agents)
    disturbed = session(options, f"kills_{options.seed}", planned).run()
    title = f"{options.kills} random kill -9 of server processes and uplinks, seed {options.seed}"
    return print_rows(title, compare(options, disturbed, planned))


def run_disk_full(options):
    """Uses RLIMIT_FSIZE, so it needs neither root nor a full disk."""
    begin = length_s(options) / 3
    planned = [f"at: {begin:.1f}, disk_full: agent_handler, seconds: 10"]
    disturbed = session(options, "disk_full", planned).run()
    refused = ["THE DISK REFUSES WRITES" in line for line in disturbed.summaries("agent_handler")]
    said, healed = any(refused), bool(refused) and not refused[-1]
    rows = compare(options, disturbed, planned)
    rows += [Row("the handler's status says so", "yes" if said else "no", said),
             Row("and that it is over", "yes" if healed else "no", healed)]
    return print_rows("the journal's disk full for ten seconds", rows)


def run_vio(options):
    """Keyframes of one agent are played; the other's odometry runs on its recording, and is killed halfway."""
    if not options.vio:
        print("\nkilling vio: not run, give it a recording with --vio ID RECORDING")
        return None
    id, recording = int(options.vio[0]), Path(options.vio[1])
    agents = [options.agents[0], Agent(id, None, recording)]
    seconds = options.seconds or 40
    folder = options.work / "vio"
    shutil.rmtree(folder, ignore_errors=True)
    planned = [f"at: {SECOND_STARTS_AFTER_S + seconds / 2:.1f}, kill: vio_{id}"]
    disturbed = Session(folder, options.bin, agents, planned, seconds).run()
    rows = [Row("the session's exit code", str(disturbed.exit_code), disturbed.exit_code == 0)]
    if disturbed.exit_code == 0:
        journalled = [key for key, _, _ in whole_keyframes(disturbed.journal)]
        maps = Counter(key[1] for key in journalled if key[0] == id)
        promised = all_acknowledged(disturbed, agents)
        report = disturbed.report()
        group = max(report["groups"], key=lambda group: len(group["map_ids"]))
        fused = [f"{change['session_s']:.1f}" for change in report["fused_at"] if change["change"] == "fused"]
        ate = report["ate_joint_m"]
        rows += kills(disturbed, planned) + [
            Row("maps of the killed agent, keyframes in each", ", ".join(map(str, maps.values())), len(maps) == 2),
            Row("acknowledged keyframes that are missing", f"{len(promised - set(journalled))} of {len(promised)}",
                bool(promised) and promised <= set(journalled)),
            Row("maps in the group, fused after s", f"{len(group['map_ids'])}, {' and '.join(fused)}",
                len(group["map_ids"]) == 3),
            Row("joint ATE, m", f"{ate or float('nan'):.4f}", ate is not None and ate < 0.1),
        ]
    return print_rows(f"vio killed after {seconds / 2:.0f} s: a new map, fused again, the old one kept", rows)


ALL = {"kills": run_kills, "disk_full": run_disk_full, "vio": run_vio, "spool": offline.run, "sanitized": sanitized.run,
       "memory": memory.run}


def run(name, options):
    return ALL[name](options)
