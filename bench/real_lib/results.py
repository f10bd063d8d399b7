"""Evaluates the products of a plan: for each run, and for other systems' trajectories."""

from accuracy_lib import plan as accuracy
from accuracy_lib.metrics import read_json
from real_lib import rotations as rot
from real_lib import trajectory
from real_lib.constraints import accepted
from real_lib.cycles import nees
from real_lib.funnel import covisible, funnel
from real_lib.measure import best_shift, check_constraints, mean_and_median, measure


class Results:
    def __init__(self, plan):
        self.plan = plan
        mav0 = accuracy.mav0_of(plan.recording)
        T_rig_body, T_rig_cam = (trajectory.extrinsics(mav0 / sensor / "sensor.yaml") for sensor in ("imu0", "cam0"))
        self.T_body_cam = rot.between(T_rig_body, T_rig_cam)
        self.pieces = trajectory.grown(self._reference(T_rig_cam), plan.options.reference_scale)

    def _reference(self, T_rig_cam):
        truth = self.plan.groundtruth()
        if truth:
            poses = trajectory.moved(trajectory.read_groundtruth(truth), T_rig_cam)
            return [trajectory.Piece(piece, 0) for piece in trajectory.split_at_holes(poses)]
        return trajectory.read_pieces(self.plan.reference_file())

    def vio(self, start):
        agent = self.plan.agents[self.plan.WHERE, self.plan.start_name(start)]
        maps = self._maps(agent)
        return self._measured(max(maps, key=len), len(maps)) if maps else None

    def server(self, start):
        return self._of_server(self.plan.start_name(start))

    def halves(self, order):
        return self._of_server(f"halves_{order}")

    def funnels(self):
        """{name of a session: funnel} of those that ended well."""
        job = self.plan.covisible_job
        if not job or not job.ended_well:
            return {}
        true_pairs = covisible(job.folder / "covisible.csv")
        servers = {name: server for (where, name), (server, _) in self.plan.servers.items() if where == self.plan.WHERE}
        return {name: funnel(server.folder / "session.lcm", true_pairs) for name, server in servers.items() if server.ended_well}

    def other(self, file):
        poses = trajectory.moved(trajectory.read(file), self.T_body_cam)
        result = measure(poses, self.pieces, best_shift(poses, self.pieces))
        return {**result, "maps": 1} if result else None

    def _of_server(self, name):
        job, agents = self.plan.servers[self.plan.WHERE, name]
        report = read_json(job.folder / "report.json") if job.ended_well else None
        if not report:
            return None
        dense = [pose for agent in agents for pose in self._optimised(job.folder, agent)]
        result = self._measured(sorted(dense), len(report["groups"]))
        if result:
            result["fused"] = any(len(group["agents"]) == len(agents) for group in report["groups"])
            # Separate maps have no common scale: the scale of a constraint is then that of its first agent.
            alone = None if result["fused"] else self._measured(self._optimised(job.folder, agents[0]), 1)
            result["constraints"] = self._constraints(job.folder, agents, report, (alone or result)["scale"])
        return result

    def _constraints(self, folder, agents, report, scale):
        found = accepted(folder / "session.lcm")
        odometry = {agent.id: dict(trajectory.read(folder / f"agent_{agent.id}.vio.tum")) for agent in agents}

        def motion(of_map, t, u):
            ends = [odometry[of_map[0]].get(stamp) for stamp in (t, u)]
            return None if None in ends else rot.between(*ends)

        counts = report["constraints"]
        return {"accepted": counts["accepted"], "refused": counts["refused"], "refused_by_reason": counts["refused_by_reason"],
                "switched_off": sum(group["constraints_switched_off"] for group in report["groups"]),
                "cycles": mean_and_median(nees(found, motion)),
                **check_constraints([c for constraints in found.values() for c in constraints], self.pieces, scale, self.T_body_cam)}

    def _measured(self, body_poses, maps):
        result = measure(trajectory.moved(body_poses, self.T_body_cam), self.pieces) if body_poses else None
        return {**result, "maps": maps} if result else None

    @staticmethod
    def _maps(agent):
        """The odometry's maps, each as a list of its poses."""
        files = sorted(agent.vio.folder.glob("vio.tum*")) if agent.vio.ended_well else []
        return [poses for file in files if (poses := trajectory.read(file))]

    def _optimised(self, folder, agent):
        keyframes = trajectory.read(folder / f"agent_{agent.id}.tum")
        return [pose for odometry in self._maps(agent) for pose in
                trajectory.at_camera_rate([k for k in keyframes if odometry[0][0] <= k[0] <= odometry[-1][0]], odometry)]
