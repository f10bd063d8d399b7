// Tests pangea-site and pangea-server --site as a user runs them.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "programs.h"

namespace pangea::tests {
namespace {

namespace fs = std::filesystem;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

// Buses that only this test uses.
std::string Buses() {
  const int port = 33000 + getpid() % 6000 * 2;
  return fmt::format("--bus 'udpm://239.255.76.67:{}?ttl=0' --link 'udpm://239.255.76.67:{}?ttl=0'",
                     port, port + 1);
}

class SiteProgram : public testing::Test {
 protected:
  const fs::path folder = FreshFolder("site");
  const std::string site = folder / "hall";

  // The journal of both walks contains keyframes only, without matches or results.
  void MakeSiteOfWalks() const {
    ASSERT_EQ(Site(fmt::format("create {} {}", site, Buses())).exit_code, 0);
    const Outcome cut = RunCommand(
        fmt::format("pangea-log cut " PANGEA_SOURCE_DIR
                    "/logs/two_walks/session.lcm --channels 'KEYFRAME_.*' --out {}/journal.lcm",
                    site));
    ASSERT_EQ(cut.exit_code, 0) << cut.output;
  }
  static Outcome Site(const std::string& arguments) {
    return RunCommand("pangea-site " + arguments);
  }
};

TEST_F(SiteProgram, ServesASiteThatIsLookedAtAndBackedUpMeanwhile) {
  MakeSiteOfWalks();
  // The commands while the server runs, and its result at the end.
  std::ofstream(folder / "run.sh") << fmt::format(
      "pangea-server --site {0} & server=$!; sleep 6\n"
      "echo server $server\n"
      "pangea-server --site {0}; echo second server $?\n"
      "pangea-site compact {0}; echo compact $?\n"
      "pangea-site info {0}; pangea-site list {1}; pangea-site backup {0} {1}/copy.tar.zst\n"
      "kill -INT $server; wait $server; echo server ended $?\n",
      site, folder.string());
  const std::string said = RunCommand("sh " + (folder / "run.sh").string()).output;
  ASSERT_THAT(said, ContainsRegex("server [0-9]+\n"));
  const size_t at = said.find("\nserver ") + 8;
  const std::string in_use =
      fmt::format("is in use by process {}", said.substr(at, said.find('\n', at) - at));
  EXPECT_THAT(said, HasSubstr("pangea-server: " + site + ": " + in_use));
  EXPECT_THAT(said, HasSubstr("second server 1"));
  EXPECT_THAT(said, HasSubstr("pangea-site: " + site + ": " + in_use));
  EXPECT_THAT(said, HasSubstr("compact 1"));
  EXPECT_THAT(said, ContainsRegex("keyframes +63\n"));
  EXPECT_THAT(said, HasSubstr("state        " + in_use.substr(3)));
  EXPECT_THAT(said, HasSubstr("read again: the same"));
  EXPECT_THAT(said, HasSubstr("server ended 0"));
  EXPECT_TRUE(fs::exists(folder / "hall" / "logs" / "fusion.txt"));
  EXPECT_EQ(Site("restore " + (folder / "copy.tar.zst").string() + " " + site + "_2").exit_code, 0);
  EXPECT_THAT(Site("info " + site + "_2").output, ContainsRegex("keyframes +63\n"));
  EXPECT_EQ(Site("compact " + site).exit_code, 0);
}

// First a server on each walk alone, which matches its keyframes; then a server on both.
TEST_F(SiteProgram, AServerFusesTheMapsOfTwoSitesThatWereMerged) {
  std::ofstream(folder / "run.sh") << fmt::format(
      R"(cd {0}
within_a_minute() {{
  for i in $(seq 120); do sh -c "$1" >/dev/null 2>&1 && return; sleep 0.5; done
  echo "never: $1"
}}
serve_until() {{  # a site, and what to wait for
  pangea-server --site $1 >$1.txt & server=$!
  within_a_minute "$2"
  kill -INT $server; wait $server
}}
for day in 1 2; do
  pangea-site create day_$day {1} >/dev/null
  pangea-log cut {2}/logs/two_walks/session.lcm --channels KEYFRAME_$day --out day_$day/journal.lcm
  serve_until day_$day "pangea-site info day_$day | grep -q 'matches *3[12]$'"
done
pangea-site merge day_1 day_2 --out both
serve_until both "pangea-log info both/journal.lcm | grep -qE '^ +[2-9][0-9] +accepted'"
# A log says what is there after the start, and nothing of numbers that change later. That of the first
# server would end the second before it listens to signals.
rm both/logs/posegraph.txt
serve_until both "grep -q 'posegraph: 2 maps in 1 groups' both/logs/posegraph.txt"
)",
      folder.string(), Buses(), PANGEA_SOURCE_DIR);
  const std::string said = RunCommand("sh " + (folder / "run.sh").string()).output;
  EXPECT_THAT(said, HasSubstr("both: 32 keyframes of day_1, 31 of day_2"));
  EXPECT_THAT(said, HasSubstr("no agent can join yet: both/keys has no keys"));
  EXPECT_THAT(said, Not(HasSubstr("never")));
}

// Another site gets the name of a moved one; a process that is started again writes into the old.
TEST_F(SiteProgram, AServerStaysInItsSiteWhenTheFolderIsMoved) {
  ASSERT_EQ(Site(fmt::format("create {} {}", site, Buses())).exit_code, 0);
  std::ofstream(folder / "fusion.yaml") << "{}\n";
  std::ofstream(folder / "run.sh") << fmt::format(
      R"sh(cd {}
handler() {{ pgrep -P $server -f pangea-agent-handler; }}
pangea-server --site hall --options fusion=fusion.yaml & server=$!
sleep 3; killed=$(handler)
mv hall moved; pangea-site create hall {}
kill -9 $killed
for i in $(seq 100); do sleep 0.1; [ "$(handler)" != $killed ] && [ -n "$(handler)" ] && break; done
sleep 1
echo journal $(readlink /proc/$(handler)/fd/* | grep journal.lcm)
kill -INT $server; wait $server; echo server ended $?
ls hall hall/logs
)sh",
      folder.string(), Buses());
  const std::string said = RunCommand("bash " + (folder / "run.sh").string()).output;
  EXPECT_THAT(said, ContainsRegex("journal [^ ]*/moved/journal.lcm\n"));
  EXPECT_THAT(said, HasSubstr("--options " + (folder / "fusion.yaml").string()));
  EXPECT_THAT(said, HasSubstr("server ended 0\nhall:\nkeys\nlogs\noptions\nsite.yaml\n\n"
                              "hall/logs:\n"));
}

TEST_F(SiteProgram, ExportsTrajectoriesAndPoints) {
  MakeSiteOfWalks();
  const Outcome outcome = Site(fmt::format("export {} --out {}/out", site, folder.string()));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  for (const char* file : {"agent_1.tum", "agent_2.tum", "map.ply"}) {
    EXPECT_TRUE(fs::exists(folder / "out" / file)) << file;
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / "out"), fs::directory_iterator()), 3);
}

// Earlier versions let a site be made inside another one.
TEST_F(SiteProgram, ABackupSaysWhichSiteIsNotInIt) {
  MakeSiteOfWalks();
  Site("create " + (folder / "annex").string());
  fs::rename(folder / "annex", folder / "hall" / "annex");
  const Outcome outcome = Site("backup " + site + " " + (folder / "copy").string());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr(site + "/annex: is a site of its own, and not in this"));
}

TEST_F(SiteProgram, DeletesWhatIsNamed) {
  Site("create " + site + " --name 'The hall'");
  Outcome outcome = RunCommand("echo hall | pangea-site delete " + site);
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.output, HasSubstr("'hall' is not the site's name, 'The hall'"));
  EXPECT_TRUE(fs::exists(site));
  EXPECT_EQ(Site("delete " + site).exit_code, 1);  // no user there to confirm it
  outcome = RunCommand("echo The hall | pangea-site delete " + site);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_FALSE(fs::exists(site));
}

// The server does not start, and the site stays as it was.
TEST_F(SiteProgram, RefusesAWrongFileOfTags) {
  ASSERT_EQ(Site("create " + site).exit_code, 0);
  const fs::path file = fs::path(site) / "tags.yaml";
  std::ofstream(file) << "tags:\n- {ids: 0-19, size_m: 0.16}\n- {ids: 7, size_m: 0.4}\n";
  for (const std::string& command :
       {"pangea-server --site " + site, "pangea-site tags " + file.string(),
        "pangea-fusion --tags " + file.string()}) {
    const Outcome refused = RunCommand(command);
    EXPECT_NE(refused.exit_code, 0) << command;
    EXPECT_THAT(refused.output, HasSubstr("tags.yaml: tags[1].ids: 7 is there twice"));
  }
  EXPECT_FALSE(fs::exists(fs::path(site) / "journal.lcm"));
  std::ofstream(file) << "tags:\n- {ids: 0-19, size_m: 0.16}\n";
  const Outcome checked = RunCommand("pangea-site tags " + file.string());
  EXPECT_EQ(checked.exit_code, 0);
  EXPECT_THAT(checked.output, HasSubstr("20 tags"));
}

TEST_F(SiteProgram, PrintsATagOnce) {
  const fs::path sheet = folder / "tag.svg";
  const std::string command =
      "pangea-site tags --print " + sheet.string() + " --id 7 --size-mm 120";
  const Outcome printed = RunCommand(command);
  EXPECT_EQ(printed.exit_code, 0) << printed.output;
  EXPECT_THAT(printed.output, HasSubstr("{ids: 7, size_m: 0.12}"));
  EXPECT_THAT(ReadFile(sheet), HasSubstr("36h11:7"));
  EXPECT_NE(RunCommand(command).exit_code, 0) << "nothing is overwritten";
}

TEST_F(SiteProgram, SaysWhatIsWrongWithACommand) {
  EXPECT_THAT(Site("info " + site).output, HasSubstr("is no site: it has no site.yaml"));
  EXPECT_THAT(Site("list " + site).output, HasSubstr("is no folder"));
  EXPECT_THAT(Site("merge " + site).output, HasSubstr("second is required"));
  EXPECT_NE(Site("").exit_code, 0);
  std::ofstream(folder / "thesis.tex") << "x";
  EXPECT_THAT(RunCommand("pangea-server --site " + folder.string()).output,
              HasSubstr("'thesis.tex' in it is nothing of a site's"));
  for (const char* other : {"--journal x", "--keys x", "--logs x", "--options-dir x"}) {
    const Outcome outcome = RunCommand(fmt::format("pangea-server --site {} {}", site, other));
    EXPECT_THAT(outcome.output, HasSubstr("--site excludes --")) << other;
    EXPECT_GT(outcome.exit_code, 100);
  }
  EXPECT_THAT(RunCommand("pangea-server").output, HasSubstr("give --site FOLDER, or --journal"));
  EXPECT_FALSE(fs::exists(site));
}

}  // namespace
}  // namespace pangea::tests
