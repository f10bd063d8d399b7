#!/usr/bin/env python3
"""Tests that each thing has one word, that of the field: words that this project once invented must not be used. Also limits the words."""

import os
import re
import subprocess
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

# Each old word stands beside the words to use instead; capitals count.
WORDS = [
    (r"(?i)verdict", "verification result"),
    (r"\b[Jj]udg(e[sd]?|ing|ements?)\b|[a-z]Judg|judge_", "(loop) verifier, to verify"),
    (r"InertialLink|\bStartLink\b|\bAddLink|\blinks? (of|between) (keyframes|maps)\b|\b(loop|odometry|inter|intra) links?\b"
     r"|\blinks? accepted|\baccepted links?\b|\bvague link", "constraint, loop closure, IMU factor; link is the network's"),
    (r"\bnormali[sz]ed squares\b|\bsquares (a|per) dimension\b|\| squares \||AddSquare\b", "NEES"),
    (r"\b[Tt]urn[ _]rate\b|\b(a|A|the|one|this|[Ee]ach|best|slow|fast|small) turn\b(?! comes)|[a-z]Turn(?!On|Comes|edBack)[A-Z(]"
     r"|\b\w+_turn\b|\bturn_(?!on\b)\w+|\bTurned|\b[Tt]urn\(|\bturn [=*]|\bturned? (about|by) ", "rotation, yaw"),
    (r"\b[Mm]ounts\b|\bMOUNTS\b|\b(the|a|camera) mount\b|\bmounting\b", "extrinsics"),
    (r"\b[Aa]t[ _]rest\b|AtRest|RestDetector|rest_detector|AddRest|kRest[A-Z]|RestTogether|RestResidual|\bbody rests\b"
     r"|\bresting\b|\ba rest\b", "stationary, zero-velocity update"),
    (r"\b(is|last|a)_sight\b|\.stays\b|\bstays = |DropPassing|LastStaying|\bis a sight\b|\bpassing frames?\b|\bframes? that stays?\b"
     r"|\ba frame stays\b", "keyframe, tracked, non-keyframe"),
    (r"(?i)surrounding", "visibility check"),
    (r"AskAgain|AskAllAgain|TellAgain|TakeAgain|OnAgain|PublishAgain|\b(said|sent|told|keyframes)_again\b"
     r"|\b(ask|asks|tell|tells|told) (it )?again\b", "retransmission request, retransmission"),
    (r"\b[Oo]w(e|es|ed|ing)\b|Owed|_owed\b|\bowed_", "outstanding"),
    (r"\b[Nn]ews\b|News[A-Z(]|[a-z]News\b|_news_?\b|LoggedWord|ReadWords", "message, update"),
    (r"(?<![<\w/.\"'])[Ff]igures?\b(?! (of eight|\d))|Figures[A-Z(]?\b|[a-z]Figures", "metric, value"),
    (r"(?i)imu_?scales|kScalesSize|ScalesVector|ScalesJacobian|ScalesCovariance|\bthe IMU's scales\b", "IMU intrinsics"),
    (r"\bmeetings?\b|MEETINGS|meetings_|other[_ ]worlds|(?i:hybrid)", "what the bench measures"),
    (r"AlignmentOptions|LiveAlignment|MapAlignment|alignment_yaml|(?<!Trajectory)AlignmentKind|AlignmentPrior",
     "loop verification, localization; alignment is the transform between two maps"),
    (r"\b(struct|class) Map\b", "a name that says which map"),
    (r"\bmin_\w*looks|\bLooks\(|DifferentLook|\blook_(angle|distance)", "viewpoint"),
]

# Released names stay as they are: existing logs and other programs contain them.
FROZEN = [
    r"verdict_request(_t)?\b", r"\bnum_verdicts\b", r"VERDICT_REQUEST", r"\bagain_t\b", r"AGAIN_", r"kAgainPrefix",
    r"the surroundings contradict",  # a constraint_t.reason in existing logs
]
# Words of the table that have another meaning in these files.
ALLOWED = {
    "modules/report/html/report_script.cc": [r"\bfigure\b"],  # the HTML element
    "modules/report/html/report_svg.h": [r"\bfigure\b"],
    "modules/report/html/report_svg.cc": [r"\bfigure\b"],
}

CODE = ["modules", "bench", "tests", "examples", "scripts", "sessions", "cmake", "packaging", "lcmtypes", "CMakeLists.txt"]
CODE_SUFFIXES = {"", ".cc", ".h", ".py", ".ts", ".js", ".mjs", ".html", ".css", ".cmake", ".in", ".txt", ".yaml", ".conf", ".service", ".lcm"}
SKIPPED_FOLDERS = {"corpus", "node_modules", "build", "__pycache__"}
SKIPPED = {"words_test.py", "package-lock.json"}

DOCS = ["README.md", "docs", "modules", "bench", "examples", "lcmtypes", "logs", "sessions", "tests"]


def files(roots, suffixes):
    for root in map(ROOT.joinpath, roots):
        if root.is_file():
            yield root
        for folder, subfolders, names in os.walk(root):
            subfolders[:] = sorted(set(subfolders) - SKIPPED_FOLDERS)
            found = (Path(folder, name) for name in sorted(set(names) - SKIPPED))
            yield from (file for file in found if file.suffix in suffixes and not file.is_symlink())


def without(text, expressions):
    return re.sub("|".join(expressions), "", text)


def files_with(expression, paths):
    """The files that may have the expression: grep is ten times faster than Python."""
    grep = subprocess.run(["grep", "-alP", expression, "--", *paths], env={**os.environ, "LC_ALL": "C"}, stdout=subprocess.PIPE, text=True)
    if grep.returncode > 1:
        raise RuntimeError(f"grep does not take {expression}")
    return map(Path, grep.stdout.splitlines())


def found(roots, suffixes):
    """Each word of the table that is found: file:line: the word, and its replacement."""
    out = []
    paths = list(files(roots, suffixes))
    for expression, say in WORDS:
        for file in files_with(expression, paths):
            name = str(file.relative_to(ROOT))
            try:
                text = without(file.read_text(), FROZEN + ALLOWED.get(name, []))
            except UnicodeDecodeError:
                continue  # not a text file
            out += [f"{name}:{text.count(chr(10), 0, hit.start()) + 1}: '{hit.group(0)}': say {say}" for hit in re.finditer(expression, text)]
    return sorted(out)


# Largest numbers of words, without tables' lines, or lists would replace them: what one can read at one sitting, or what fits on a page.
LONGEST = {"README.md": 900, "bench/README.md": 2900, "docs/decisions/*.md": 420}
ALL_PAGES = ["README.md", "docs/*.md", "docs/decisions/*.md", "bench/README.md", "lcmtypes/README.md", "logs/README.md"]
MOST_WORDS = 25850


def words_of(pattern):
    return {str(path.relative_to(ROOT)): sum(any(c not in "|-:" for c in word) for word in path.read_text().split()) for path in ROOT.glob(pattern)}


class Length(unittest.TestCase):
    def test_pages(self):
        for pattern, most in LONGEST.items():
            self.assertTrue(words_of(pattern), pattern)
            for name, count in words_of(pattern).items():
                self.assertLessEqual(count, most, name)

    def test_all(self):
        count = sum(sum(words_of(pattern).values()) for pattern in ALL_PAGES)
        self.assertGreater(count, MOST_WORDS / 2)
        self.assertLessEqual(count, MOST_WORDS, "say each thing once, and link to it")


class Words(unittest.TestCase):
    def test_code(self):
        hits = found(CODE, CODE_SUFFIXES)
        self.assertFalse(hits, "\n" + "\n".join(hits))

    def test_docs(self):
        hits = found(DOCS, {".md"})
        self.assertFalse(hits, "\n" + "\n".join(hits))

    def test_the_table_finds_its_words(self):
        for line in ["the verdicts on it", "void Judge();", "InertialLink link;", "at rest", "state.at_rest", "the surroundings check",
                     "AskAgain(node)", "what is owed", "there is no news", "ReportFigures", "kImuScales", "struct Map {", "hybrid"]:
            self.assertTrue(any(re.search(expression, without(line, FROZEN)) for expression, _ in WORDS), line)
        for line in ["verdict_request_t request", "channels::Again(name)", "the rest of the bytes", "the uplink's link", "in turn",
                     "its turn comes", "<figure class", "a figure of eight", "returns", "least squares", "the keys stay"]:
            self.assertFalse(any(re.search(expression, without(line, FROZEN)) for expression, _ in WORDS), line)


if __name__ == "__main__":
    unittest.main()
