"""A whole session of programs built with a sanitizer: none of them may report an error."""

import dataclasses
import shutil
from collections import Counter
from pathlib import Path

from faults_lib.checks import Row, delivery, kills, print_rows
from faults_lib.session import SERVER, Session

SUPPRESSIONS = Path(__file__).resolve().parents[2] / "tsan.supp"
RUNTIMES = {b"__tsan_init": "thread", b"__asan_init": "address", b"__ubsan_handle": "undefined behaviour"}
LINK = "loss: 0.05, delay_ms: 20, jitter_ms: 10, reorder: 0.02, duplicate: 0.02"
KILLED = ("agent_handler", "posegraph", "place_recognition")


def sanitizers(bin, program):
    code = (bin / f"pangea-{program.replace('_', '-')}").read_bytes()
    return [name for symbol, name in RUNTIMES.items() if symbol in code]


def environment(reports):
    """Reports go to files, one per process, and do not change a process's exit code."""
    to = f"log_path={reports}/report"
    return {"TSAN_OPTIONS": f"suppressions={SUPPRESSIONS}:exitcode=0:{to}", "ASAN_OPTIONS": f"exitcode=0:{to}",
            "UBSAN_OPTIONS": f"print_stacktrace=1:{to}"}


def what(report):
    """The lines of a report that describe the error."""
    return [line.strip() for line in report.read_text(errors="replace").splitlines()
            if line.startswith("SUMMARY:") or ": runtime error:" in line]


def run(options):
    built_with = sanitizers(options.bin, "agent_handler")
    if not built_with:
        print(f"\nsanitized: not run, the programs in {options.bin} are built without a sanitizer (--bin build/tsan/bin)")
        return None
    folder = options.work / "sanitized"
    shutil.rmtree(folder, ignore_errors=True)
    reports = folder / "reports"
    reports.mkdir(parents=True)
    agents = [dataclasses.replace(agent, link=f"{LINK}, seed: {agent.id}") for agent in options.agents]
    killed = [*KILLED, f"uplink_{agents[0].id}"]
    planned = [f"at: {6 + 3 * i}, kill: {name}" for i, name in enumerate(killed)]
    session = Session(folder, options.bin, agents, planned, options.seconds, environment=environment(reports)).run()
    found = Counter(line for report in sorted(reports.iterdir()) for line in what(report) or [f"unreadable: {report}"])
    programs = [*SERVER, "uplink", "link_emulator"]
    instrumented = [program for program in programs if sanitizers(options.bin, program) == built_with]
    rows = [Row("programs built with it, of the server's and the link's", f"{len(instrumented)} of {len(programs)}",
                instrumented == programs),
            Row("the session's exit code", str(session.exit_code), session.exit_code == 0),
            Row("reports of the sanitizer", str(sum(found.values())), not found)]
    if session.exit_code == 0:
        rows += delivery(session, agents, options.seconds)
        rows += kills(session, planned)
    held = print_rows(f"a session over a bad link, {' and '.join(built_with)} sanitizer", rows)
    for line, times in found.most_common():
        print(f"          {times} x {line}")
    return held
