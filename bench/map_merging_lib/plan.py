"""The jobs for the table: render each recording, run VIO on it, run the server on it alone and on each session in both orders."""

from accuracy_lib import plan as accuracy
from accuracy_lib.jobs import OUT, Command
from map_merging_lib import ways
from map_merging_lib.worlds import SESSIONS, WORLDS
from generalization_lib.plan import Spoiling


class Plan(accuracy.Plan):
    """Worlds and sessions as accuracy_lib's plan has recordings and pairs; `where` is always WHERE."""

    WHERE = "worlds"

    def sessions(self):
        return [m for m in SESSIONS if not self.options.sessions or m.name in self.options.sessions]

    def worlds(self):
        wanted = {name for session in self.sessions() for name in session.names}
        return [world for world in WORLDS if world.name in wanted]

    def make(self):
        for world in self.worlds():
            recording = self._recording(world)
            agent = self._vio(self.WHERE, world.name, 1 + WORLDS.index(world), recording, recording.folder)
            self._server(self.WHERE, world.name, [agent])
        for session in self.sessions():
            agents = [self.agents[self.WHERE, name] for name in session.names]
            self._server(self.WHERE, session.name, agents)
            self._server(self.WHERE, session.name + " back", agents[::-1])
        return self.jobs

    def _recording(self, world):
        render = self._rendering(world)
        return Spoiling.added(self, world.name, render, ["phone_imu"]) if world.lens == "phone" else render

    def _rendering(self, world):
        kind, seed = world.scene
        argv = [str(self.bin / "pangea-sim"), "--scene", kind, "--scene-seed", str(seed), "--path", f"{OUT}/{world.name}.tum"]
        together = [other for other in WORLDS if other.scene == world.scene]
        argv += ["--keep-clear", *(f"{OUT}/{other.name}.tum" for other in together)]
        argv += ["--duration", f"{world.seconds:g}", "--camera", world.lens, "--image-rate", str(world.rate), *world.options]
        argv += ["--out", OUT, "--seed", str(seed), "--threads", "1", "--no-cache"]
        job = accuracy.RenderJob("render", world.name, self.work / "rendered" / world.name, [Command(argv)])
        # A second more, from which the simulator takes the margin that its exposure needs.
        job.files = {f"{other.name}.tum": ways.tum(other.way, other.seconds + 1, other.lens) for other in together}
        self.jobs.append(job)
        return job
