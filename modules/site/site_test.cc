#include "site/site.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>

#include "checkpoint/checkpoint_file.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "site/backup.h"
#include "site/site_delete.h"
#include "site/site_export.h"
#include "site/site_info.h"
#include "site/site_test_world.h"

namespace pangea::site {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

TEST(Site, IsReadAsItWasMade) {
  const fs::path folder = FreshFolder("made") / "hall";
  SiteDescription description = NewDescription("The \"hall\": north");
  description.bus = "udpm://239.255.76.67:7001?ttl=0";
  const Site made = CreateSite(folder, description);
  EXPECT_EQ(fs::status(made.keys()).permissions(), fs::perms::owner_all);
  const Site read = ReadSite(folder);
  EXPECT_EQ(read.description.name, description.name);
  EXPECT_EQ(read.description.bus, description.bus);
  EXPECT_EQ(read.description.created, description.created);
}

TEST(Site, IsMadeAtTheFirstOpeningAndFoundAtTheSecond) {
  const fs::path folder = FreshFolder("opened") / "hall";
  EXPECT_EQ(OpenSite(folder).description.name, "hall");
  EXPECT_EQ(OpenSite(folder / "").description.name, "hall");
}

// `cd hall; pangea-site create .`
TEST(Site, IsTheFolderOneIsIn) {
  const fs::path folder = FreshFolder("dot"), hall = folder / "hall";
  fs::create_directories(hall);
  EXPECT_EQ(OpenSite(hall / ".").description.name, "hall");
  EXPECT_EQ(Delete(ReadSite(hall / "."), false).filename().string().rfind("hall.deleted-", 0), 0u);
  EXPECT_FALSE(fs::exists(hall));
  EXPECT_THAT(ListSites(folder), testing::EndsWith("  deleted\n"));
  fs::create_directories(hall);
  SiteInTheMaking made(hall / ".");
  made.Commit(NewDescription("hall"));
  EXPECT_EQ(ReadSite(hall).description.name, "hall");
}

TEST(Site, IsMadeOfAJournalThatWasThere) {
  const fs::path folder = FreshFolder("adopted");
  std::ofstream(folder / "journal.lcm") << "";
  fs::create_directories(folder / "keys");
  fs::create_directories(folder / "checkpoint");  // its site.yaml was lost
  EXPECT_NO_THROW(OpenSite(folder));
}

TEST(Site, RefusesAFolderOfSomethingElse) {
  const fs::path folder = FreshFolder("else");
  std::ofstream(folder / "thesis.tex") << "x";
  EXPECT_THAT(WhyNot([&] { OpenSite(folder); }), HasSubstr("'thesis.tex' in it is nothing of"));
  EXPECT_FALSE(fs::exists(folder / "keys"));
  EXPECT_THAT(WhyNot([&] { OpenSite(folder / "thesis.tex"); }), HasSubstr("is no folder"));
  EXPECT_THAT(WhyNot([&] { ReadSite(folder); }), HasSubstr("it has no site.yaml"));
  EXPECT_THAT(WhyNot([&] { ReadSite(folder / "thesis.tex"); }), HasSubstr("is no folder"));
  EXPECT_THAT(WhyNot([&] { NameOfFolder(""); }), HasSubstr("name is empty"));
  EXPECT_THAT(WhyNot([&] { CreateSite("", NewDescription("x")); }), HasSubstr("name is empty"));
  EXPECT_THAT(WhyNot([&] { SiteInTheMaking(""); }), HasSubstr("name is empty"));
}

TEST(Site, IsNamedAsAShellHasIt) {
  EXPECT_EQ(InShell("/maps/hall_2"), "/maps/hall_2");
  EXPECT_EQ(InShell("my hall"), "'my hall'");
  EXPECT_EQ(InShell("Anna's"), "'Anna'\\''s'");
}

// Whoever deletes the outer site would delete it too.
TEST(Site, RefusesWhatIsInsideASite) {
  const fs::path folder = FreshFolder("inside");
  const Site hall = MakeSite(folder / "hall", {});
  fs::create_directory_symlink(hall.folder, folder / "link");
  const std::string inside = "is inside the site " + hall.folder.string();
  for (const char* name :
       {"hall/annex", "hall/recordings/annex", "hall/../hall/annex", "link/annex", "hall/annex/"}) {
    EXPECT_THAT(WhyNot([&] { CreateSite(folder / name, NewDescription("annex")); }),
                HasSubstr(inside))
        << name;
    EXPECT_THAT(WhyNot([&] { SiteInTheMaking(folder / name); }), HasSubstr(inside)) << name;
  }
  EXPECT_THAT(WhyNot([&] { BackUp(hall, hall.folder / "copy.tar.zst", false); }),
              HasSubstr(inside));
  EXPECT_THAT(WhyNot([&] { ExportSite(hall, hall.folder / "out", nullptr); }), HasSubstr(inside));
  EXPECT_EQ(ForeignFile(hall.folder), "");
  EXPECT_TRUE(SitesInside(hall).empty());
  EXPECT_NO_THROW(CreateSite(folder / "annex", NewDescription("annex")));
}

TEST(Site, IsNotRemovedWithFilesOfOthers) {
  const Site site = MakeSite(FreshFolder("foreign") / "hall", {});
  std::ofstream(site.folder / "thesis.tex") << "x";
  EXPECT_THAT(WhyNot([&] { Delete(site, true); }),
              HasSubstr("'thesis.tex' in it is nothing of a site's"));
  EXPECT_TRUE(fs::exists(site.folder / "thesis.tex"));
  fs::remove(site.folder / "thesis.tex");
  EXPECT_EQ(Delete(site, true), "");
  EXPECT_FALSE(fs::exists(site.folder));
}

TEST(Site, NamesFileAndFieldOfWhatIsWrong) {
  const fs::path folder = FreshFolder("wrong");
  const auto refused = [&](const std::string& yaml) {
    std::ofstream(folder / "site.yaml") << yaml;
    return WhyNot([&] { ReadSite(folder); });
  };
  const std::string rest = "created: now\nbus: a\nlink: b\n";
  EXPECT_THAT(refused("format: 2\nname: x\n" + rest), HasSubstr("site.yaml: format: 2; this"));
  EXPECT_THAT(refused("format: 1\nname: \"\"\n" + rest), HasSubstr("site.yaml: name: give 1 to"));
  EXPECT_THAT(refused("format: 1\nname: x\ncreated: now\nbus: a\nlink: a\n"),
              HasSubstr("two LCM URLs that differ"));
  EXPECT_THAT(
      refused("format: 1\nname: x\ncreated: now\nbus: udpm://?ttl=0\nlink: udpm://?ttl=1\n"),
      HasSubstr("two LCM URLs that differ"));
  EXPECT_THAT(refused("format: 1\nname: x\ncreated: now\nbus: foo\nlink: udpm://\n"),
              HasSubstr("site.yaml: bus: 'foo' is no LCM URL"));
  EXPECT_THAT(refused("format: 1\nname: x\ncreated: now\nbus: tcpq://a:1\nlink: udpm://x:y\n"),
              HasSubstr("site.yaml: link: cannot open the bus 'udpm://x:y'"));
  EXPECT_THAT(refused("format: 1\n" + rest), HasSubstr("name"));
  EXPECT_THAT(refused("format: 1\nnaem: x\n" + rest), HasSubstr("did you mean 'name'"));
}

TEST(Site, IsNotMadeWithABusThatCannotBeOpened) {
  const fs::path folder = FreshFolder("no_bus") / "hall";
  SiteDescription description = NewDescription("hall");
  description.bus = "foo";
  EXPECT_THAT(WhyNot([&] { CreateSite(folder, description); }), HasSubstr("bus: 'foo' is no LCM"));
  EXPECT_FALSE(fs::exists(folder));
}

TEST(SiteLock, IsHeldByOneAndNamesIt) {
  const Site site = CreateSite(FreshFolder("lock") / "hall", NewDescription("hall"));
  EXPECT_FALSE(UserOf(site));
  int ready[2], end[2];
  ASSERT_EQ(pipe(ready), 0);
  ASSERT_EQ(pipe(end), 0);
  const pid_t other = fork();
  if (other == 0) {
    const SiteLock lock(site);
    char byte = 'x';
    [[maybe_unused]] auto n = write(ready[1], &byte, 1);
    n = read(end[0], &byte, 1);
    _exit(0);
  }
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  EXPECT_EQ(UserOf(site), other);
  const std::string named = "is in use by process " + std::to_string(other);
  EXPECT_THAT(WhyNot([&] { const SiteLock lock(site); }), HasSubstr(named));
  EXPECT_THAT(WhyNot([&] { Delete(site, true); }), HasSubstr(named));
  ASSERT_EQ(write(end[1], &byte, 1), 1);
  waitpid(other, nullptr, 0);
  EXPECT_FALSE(UserOf(site));  // also if the other process did not release the lock itself
  EXPECT_NO_THROW(const SiteLock lock(site));
}

TEST(SiteInfo, CountsWhatIsThere) {
  std::vector<StoredEvent> events = WalksOf({1, 2});
  events.push_back(EditEvent({1, 7}, 1, 0));
  events.push_back(EditEvent({1, 8}, 1, 1));
  events.push_back(EditEvent({1, 7}, 2, 2, true));
  const Site site = MakeSite(FreshFolder("info") / "hall", events);
  const SiteInfo info = ReadInfo(site);
  EXPECT_EQ(info.keyframes.size(), 2u);
  EXPECT_EQ(info.keyframes.begin()->second.size(), 32u);
  EXPECT_EQ(info.matches, 63);
  EXPECT_EQ(info.constraints_accepted, 56);
  EXPECT_EQ(info.constraints_refused, 9);
  EXPECT_EQ(info.anchors, 1);
  EXPECT_TRUE(info.reading.whole());
  EXPECT_TRUE(info.checkpoints.empty());
  EXPECT_GT(info.free_bytes, 0);
  EXPECT_THAT(ToText(info), HasSubstr("damage       none\n"));
  EXPECT_THAT(ListSites(site.folder.parent_path()), HasSubstr("not in use"));
}

// As /var/lib/pangea for people who are not the server's user. Else they are told to make a site.
TEST(SiteInfo, TellsOfFoldersThatOneMayNotRead) {
  const fs::path folder = FreshFolder("info_rights"), others = folder / ".local/share/pangea";
  MakeSite(others / "hall", {});
  const uid_t user = geteuid();
  setenv("HOME", folder.c_str(), 1);
  fs::permissions(others, fs::perms::none);
  ASSERT_TRUE(user != 0 || seteuid(65534) == 0) << "root may read everything";
  const std::vector<fs::path> folders = DefaultSiteFolders();
  const std::string list = ListSites(others.parent_path());
  ASSERT_EQ(seteuid(user), 0);
  fs::permissions(others, fs::perms::owner_all);
  EXPECT_THAT(folders, testing::Contains(others));
  EXPECT_THAT(list, HasSubstr(others.string() + "  Permission denied"));
}

// The server has refused the others.
TEST(SiteInfo, CountsNoMoreAnchorsThanThereMayBe) {
  const Site site = MakeSite(FreshFolder("info_anchors") / "hall",
                             {EditEvent({1, 7}, 1, 0), EditEvent({1, 8}, 1, 1)});
  EXPECT_EQ(ReadInfo(site).anchors, 2);
  std::ofstream(site.options() / "anchors.yaml") << "max_anchors: 1\n";
  EXPECT_EQ(ReadInfo(site).anchors, 1);
}

// Those that were thinned away are not lost.
TEST(SiteInfo, CallsOnlyKeyframesMissingThatNoEdgeLeadsOver) {
  std::vector<StoredEvent> events;
  for (StoredEvent& event : WalksOf({1})) {
    KeyframeMessage keyframe{};
    if (event.channel != "KEYFRAME_1" || !DecodeMessage(event.data, &keyframe)) {
      continue;
    }
    const int32_t seq = keyframe.id.seq;
    if (seq == 8) {
      keyframe.edge_from_seq = 4;
      event.data = EncodeMessage(keyframe);
    }
    if ((seq < 5 || seq > 7) && seq != 20 && seq != 21) {
      events.push_back(event);
    }
  }
  const Site site = MakeSite(FreshFolder("info_gaps") / "hall", events);
  EXPECT_THAT(ToText(ReadInfo(site)), HasSubstr("27 keyframes, 2 missing\n"));
}

TEST(SiteInfo, TellsHowMuchOfTheJournalACheckpointCovers) {
  const Site site = MakeSite(FreshFolder("info_checkpoint") / "hall", WalksOf({1}));
  const auto half = static_cast<int64_t>(fs::file_size(site.journal())) / 2;
  CheckpointWriter(site.checkpoints() / "fusion", {"fusion", 1, ""}, {half, 0, 0}).Commit();
  std::ofstream(site.checkpoints() / "posegraph") << "none";
  const std::string text = ToText(ReadInfo(site));
  EXPECT_THAT(text, HasSubstr("fusion: 50 % of the journal\n"));
  EXPECT_THAT(text, HasSubstr("posegraph: not used, it is torn"));
}

TEST(SiteInfo, TellsDamageButNotWhatAServerIsWriting) {
  const Site site = MakeSite(FreshFolder("torn") / "hall", WalksOf({1}));
  fs::resize_file(site.journal(), fs::file_size(site.journal()) - 5);
  EXPECT_THAT(ToText(ReadInfo(site)), testing::Not(HasSubstr("damage       none")));
  const SiteLock lock(site);
  EXPECT_THAT(ToText(ReadInfo(site)), HasSubstr("damage       none\n"));
}

TEST(SiteDelete, MovesAwayOrRemoves) {
  const fs::path folder = FreshFolder("delete");
  Site site = MakeSite(folder / "hall", WalksOf({1}));
  const fs::path away = Delete(site, false);
  EXPECT_FALSE(fs::exists(site.folder));
  EXPECT_TRUE(fs::exists(away / "journal.lcm"));
  site = CreateSite(folder / "hall", NewDescription("hall"));
  EXPECT_EQ(Delete(site, true), "");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
}

}  // namespace
}  // namespace pangea::site
