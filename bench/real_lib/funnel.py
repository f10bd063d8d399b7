"""Where true revisits die between retrieval and constraint.

The truth are pairs of images more than 10 s apart that share at least SHARED points of a structure from motion that matched all pairs
of images (covisible.csv of colmap.py). A pair reaches a stage if one of the pairs of keyframes near it does: each end within NEAR
seconds. So a revisit is lost only where all of its keyframes are lost.
"""

import csv
import struct
import subprocess

from link_lib.metrics import events, keyframes

NEAR = 0.6  # s
SHARED = 15
STAGES = ["seen", "retrieved", "matched", "epipolar", "guessed", "accepted"]
# Refusals of the verification before it has a relative pose.
NO_POSE = {"too few matched points with a depth", "a keyframe was lost", "no odometry leads from one to the other"}


def covisible(path):
    """[(seconds, seconds)] of the true pairs, the earlier image first."""
    with open(path, newline="") as file:
        return [(float(a), float(b)) for a, b, shared in csv.reader(file) if int(shared) >= SHARED]


class Reader:
    """The fields of an encoded message, one after the other; the fingerprint is skipped."""

    def __init__(self, data):
        self.data, self.at = data, 8

    def take(self, form):
        values = struct.unpack_from(">" + form, self.data, self.at)
        self.at += struct.calcsize(">" + form)
        return values

    def text(self):
        (size,) = self.take("i")
        return self.take(f"{size}s")[0][:-1].decode()


def place_match(data):
    """The query, the matched keyframes, and for each retrieved one that was dropped its name and the reason."""
    reader = Reader(data)
    query = reader.take("iqi")
    candidates = []
    for _ in range(reader.take("h")[0]):
        candidates.append(reader.take("iqi"))
        (matches,) = reader.take("bfh")[2:]
        reader.take(f"{2 * matches}h")
    rejected = [reader.text() for _ in range(reader.take("h")[0])]
    return query, candidates, rejected


def constraint(data):
    reader = Reader(data)
    _, *ends = reader.take("qiqiiqi")
    _, accepted = reader.take("bb")
    return tuple(ends[:3]), tuple(ends[3:]), bool(accepted), reader.text()


def stage_of_rejection(reason):
    return "epipolar" if "corner matches, others" in reason else "retrieved" if "corner matches" in reason else "matched"


def pair_stages(log):
    """[(seconds, seconds, number of the stage reached, reason)] of each pair of keyframes that recognition looked at, and the stamps of
    all keyframes."""
    stamps = {key: own / 1e6 for key, (_, own, _) in keyframes(log).items()}
    by_name = {f"{agent}/{opened}#{seq}": (agent, opened, seq) for agent, opened, seq in stamps}
    found = []

    def add(older, newer, stage, reason):
        if older in stamps and newer in stamps:
            found.append((stamps[older], stamps[newer], STAGES.index(stage), reason))

    for _, channel, data in events(log):
        if channel == "PLACE_MATCH":
            query, candidates, rejected = place_match(data)
            for match in candidates:
                add(match, query, "epipolar", "")
            for text in rejected:
                name, _, reason = text.partition(": ")
                add(by_name.get(name), query, stage_of_rejection(reason), reason)
        elif channel == "CONSTRAINT":
            older, newer, accepted, reason = constraint(data)
            add(older, newer, "accepted" if accepted else "epipolar" if reason in NO_POSE else "guessed", reason)
    return found, sorted(stamps.values())


def kind_of(reason):
    """A refusal without its numbers."""
    return " ".join(word for word in reason.split() if not any(c.isdigit() for c in word)) or "no answer"


def funnel(log, true_pairs):
    """For each stage the number of true pairs that reach it, and for those lost the last reason: {"reached": {...}, "lost": {...}}."""
    looked_at, stamps = pair_stages(log)
    reached, lost = dict.fromkeys(STAGES, 0), {}
    for a, b in true_pairs:
        if not all(any(abs(stamp - end) <= NEAR for stamp in stamps) for end in (a, b)):
            continue
        near = [(stage, reason) for t, u, stage, reason in looked_at
                if max(abs(t - a), abs(u - b)) <= NEAR or max(abs(t - b), abs(u - a)) <= NEAR]
        best = max(near, default=(0, "not retrieved"))
        for stage in STAGES[:best[0] + 1]:
            reached[stage] += 1
        if STAGES[best[0]] != "accepted":
            lost[kind_of(best[1])] = lost.get(kind_of(best[1]), 0) + 1
    return {"reached": reached, "lost": dict(sorted(lost.items(), key=lambda item: -item[1]))}


def table(rows):
    """Markdown of {name: funnel}."""
    lines = ["| | " + " | ".join(STAGES) + " | most frequent ends |", "|---" * (len(STAGES) + 2) + "|"]
    for name, result in rows.items():
        ends = ", ".join(f"{count} {reason}" for reason, count in list(result["lost"].items())[:4])
        lines.append(f"| {name} | " + " | ".join(str(result["reached"][stage]) for stage in STAGES) + f" | {ends} |")
    return "\n".join(lines)


def picture(path, rows):
    """Bars of the stages, by gnuplot."""
    script = ["set terminal pngcairo noenhanced size 1200,600 font 'sans,14' background '#ffffff'", f"set output '{path}'",
              "set ylabel 'pairs of images that see the same'", "set yrange [0:*]", "set grid ytics linecolor '#dddddd'",
              "set border 3 linecolor '#555555'", "set tics nomirror", "set key top right", "set style data histograms",
              "set style fill solid 0.8 noborder", "set boxwidth 0.9", "$data << EOD"]
    script += [" ".join([stage, *(str(result["reached"][stage]) for result in rows.values())]) for stage in STAGES] + ["EOD"]
    script.append("plot " + ", ".join(f"$data using {i + 2}:xtic(1) title '{name}'" for i, name in enumerate(rows)))
    subprocess.run(["gnuplot"], input="\n".join(script) + "\n", text=True, check=True)
