"""Jobs that make products. A product is a folder; it is made if it is missing or out of date.

A product is made in `<folder>.part` and renamed when all its commands have succeeded; its `job.json` contains the key of
its inputs: the commands, and the digests of the products that they read. So a run may be stopped at any time, and the next one
continues from there. A product that was made by another build of a program is kept, but counted (`stale`).
"""

import functools
import hashlib
import json
import shutil
import subprocess
import time
from dataclasses import dataclass, field
from pathlib import Path

OUT = "{out}"  # in a command: the folder that is being made
GOING = ("waiting", "wanted", "running")
MEASURED = ("vio", "server", "link")  # kinds of jobs whose products have what the tables show


@functools.cache
def _digest_of_version(path, size, mtime_ns):
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()[:16]


def file_digest(path):
    """Reads the file again only if it has changed."""
    stat = Path(path).stat()
    return _digest_of_version(path, stat.st_size, stat.st_mtime_ns)


@dataclass
class Command:
    argv: list
    optional: bool = False  # its failure does not fail the job


@dataclass(eq=False)
class Job:
    kind: str  # render, vio or server
    name: str
    folder: Path
    commands: list
    needs: list = field(default_factory=list)
    main_product: str = ""  # the file that dependents read; empty: the key is used as the digest
    files: dict = field(default_factory=dict)  # name -> text, written before the commands run
    outside: list = field(default_factory=list)  # files that the commands read and no job makes
    alone: bool = False  # the job itself uses all processors
    state: str = "waiting"  # then wanted, running, and done, kept, failed or skipped

    @property
    def ended_well(self):
        return self.state in ("done", "kept")

    def record(self):
        try:
            return json.loads((self.folder / "job.json").read_text())
        except (OSError, ValueError):
            return {}

    def key(self):
        """Key of the product as it would be made now; the needed products must exist. It does not depend on the folder of the programs."""
        commands = [[Path(c.argv[0]).name, *c.argv[1:]] for c in self.commands]
        outside = [[str(p), file_digest(p)] for p in self.outside]
        text = json.dumps([commands, outside, sorted(self.files.items()), [n.digest() for n in self.needs]])
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def digest(self):
        return self.record().get("digest", "") if self.main_product else self.key()

    def program(self):
        try:
            return file_digest(self.commands[0].argv[0])
        except OSError:
            return None

    def fresh(self):
        return self.record().get("key") == self.key()

    def stale(self):
        """Whether the product was made by another build of the program than the present one."""
        made_by, at_hand = self.record().get("program"), self.program()
        return None not in (made_by, at_hand) and made_by != at_hand

    def finish(self, part, seconds):
        made = {"key": self.key(), "program": self.program(), "seconds": round(seconds, 1)}
        if self.main_product:
            made["digest"] = hashlib.sha256((part / self.main_product).read_bytes()).hexdigest()[:16]
        (part / "job.json").write_text(json.dumps(made, indent=1) + "\n")
        if self.folder.exists():
            shutil.rmtree(self.folder)
        part.rename(self.folder)


def remarks(jobs):
    """Lines on what the tables do not show: jobs that did not end well, and products of another build."""
    stale = {kind: sum(job.stale() for job in jobs if job.kind == kind and job.record()) for kind in MEASURED}
    lines = [f"- {kind}: {number} products are of another build of the program (`--redo` makes them again)"
             for kind, number in stale.items() if number]
    return lines + [f"- {job.state}: {job.kind} {job.name}" for job in jobs if not job.ended_well]


class Running:
    """Runs a job's commands one after the other, each in a child process."""

    def __init__(self, job, log):
        self.job = job
        self.log = log
        self.begin = time.monotonic()
        self.part = Path(f"{job.folder}.part")
        if self.part.exists():
            shutil.rmtree(self.part)
        self.part.mkdir(parents=True)
        for name, text in job.files.items():
            (self.part / name).write_text(text)
        log.parent.mkdir(parents=True, exist_ok=True)
        self.output = log.open("w")
        self.left = list(job.commands)
        try:
            self._next()
        except OSError:
            self.output.close()
            raise

    def _next(self):
        self.command = self.left.pop(0)
        argv = [word.replace(OUT, str(self.part)) for word in self.command.argv]
        print("$", *argv, file=self.output, flush=True)
        self.child = subprocess.Popen(argv, stdin=subprocess.DEVNULL, stdout=self.output, stderr=subprocess.STDOUT)

    def poll(self):
        """"done" or "failed"; None while the job runs."""
        code = self.child.poll()
        if code is None:
            return None
        if code != 0 and not self.command.optional:
            self.output.close()
            return "failed"
        if self.left:
            self._next()
            return None
        self.output.close()
        self.job.finish(self.part, time.monotonic() - self.begin)
        return "done"

    def stop(self):
        self.child.terminate()
        self.child.wait()
        self.output.close()


class Runner:
    """Runs the jobs that are not fresh, up to `slots` at a time; a job that needs all processors runs alone."""

    def __init__(self, jobs, slots, log_folder, redo=(), after=lambda job: None):
        self.jobs = jobs
        self.slots = slots
        self.log_folder = log_folder
        self.redo = set(redo)
        self.after = after  # called when a job has succeeded
        self.running = []
        self.begin = time.monotonic()

    def run(self):
        try:
            while any(job.state in GOING for job in self.jobs):
                self._start_ready()
                time.sleep(0.1)
                self._collect()
        finally:
            for running in self.running:
                running.stop()

    def log_of(self, job):
        return self.log_folder / (job.kind + "_" + job.name.replace(" ", "_") + ".log")

    def _say(self, text):
        seconds = int(time.monotonic() - self.begin)
        over = sum(job.state not in GOING for job in self.jobs)
        print(f"[{seconds // 60:4d}:{seconds % 60:02d}] {over}/{len(self.jobs)} {text}", flush=True)

    def _start_ready(self):
        for job in self.jobs:
            if job.state == "waiting":
                self._decide(job)
            if job.state == "wanted" and self._room_for(job):
                self._start(job)

    def _decide(self, job):
        if any(need.state in ("failed", "skipped") for need in job.needs):
            job.state = "skipped"
            self._say(f"{job.kind} {job.name}: skipped, what it needs is missing")
        elif all(need.ended_well for need in job.needs):
            if job.kind not in self.redo and job.fresh():
                job.state = "kept"
                self.after(job)
            else:
                job.state = "wanted"

    def _room_for(self, job):
        if any(running.job.alone for running in self.running):
            return False
        return not self.running if job.alone else len(self.running) < self.slots

    def _start(self, job):
        try:
            self.running.append(Running(job, self.log_of(job)))
        except OSError as error:
            job.state = "failed"
            self._say(f"{job.kind} {job.name}: FAILED: {error}")
            return
        job.state = "running"
        self._say(f"{job.kind} {job.name}: started")

    def _collect(self):
        for running in list(self.running):
            try:
                state = running.poll()
            except OSError as error:
                with running.log.open("a") as log:
                    log.write(f"{error}\n")
                state = "failed"
            if state is None:
                continue
            self.running.remove(running)
            running.job.state = state
            took = time.monotonic() - running.begin
            if state == "done":
                self._say(f"{running.job.kind} {running.job.name}: done in {took:.0f} s")
                self.after(running.job)
            else:
                self._say(f"{running.job.kind} {running.job.name}: FAILED after {took:.0f} s, see {running.log}")
