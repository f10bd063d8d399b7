#include "site/backup.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <thread>
#include <vector>

#include "files/text_file.h"
#include "site/archive_file.h"
#include "site/site_files.h"
#include "site/site_test_world.h"

namespace {

// If set, the disk stores a wrong first byte of the next write.
std::atomic<bool> disk_lies = false;

}  // namespace

// Replaces the C library's function in this program.
extern "C" ssize_t pwrite(int fd, const void* data, size_t size, off_t offset) {
  const auto* const first = static_cast<const uint8_t*>(data);
  std::vector<uint8_t> bytes(first, first + size);
  if (size > 0 && disk_lies.exchange(false)) {
    bytes[0] ^= 1;
  }
  return syscall(SYS_pwrite64, fd, bytes.data(), size, offset);
}

namespace pangea::site {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class BackupTest : public testing::TestWithParam<const char*> {
 protected:
  const fs::path folder = FreshFolder("backup");
  const Site site = MakeSite(folder / "hall", WalksOf({1}));
  const fs::path copy = folder / GetParam();

  void SetUp() override {
    std::ofstream(site.options() / "fusion.yaml") << "{}\n";
    std::ofstream(site.keys() / "agent_4.key") << "secret";
    fs::permissions(site.keys() / "agent_4.key", fs::perms::owner_read | fs::perms::owner_write);
    std::ofstream(site.logs() / "fusion.txt") << "said";
    fs::create_directories(site.gateway() / "agents");
    fs::create_directories(site.gateway() / "invites");
    std::ofstream(site.gateway() / "agents" / "1001.json") << "Anna";
    std::ofstream(site.gateway() / "invites" / "00ff.json") << "Ben";
    std::ofstream(site.gateway() / "ca.pem") << "authority";
    std::ofstream(site.gateway() / "ca.key") << "its key";
  }
};

TEST_P(BackupTest, ComesBackWithoutKeysAndLogs) {
  const BackupSummary summary = BackUp(site, copy, false);
  EXPECT_EQ(summary.journal_bytes, static_cast<int64_t>(fs::file_size(site.journal())));
  Restore(copy, folder / "again");
  const Site again = ReadSite(folder / "again");
  EXPECT_EQ(again.description.name, site.description.name);
  EXPECT_EQ(again.description.created, site.description.created);
  EXPECT_EQ(EventsOf(again), EventsOf(site));
  EXPECT_EQ(FoundAtOpening(again), "");
  EXPECT_EQ(ReadTextFile(again.options() / "fusion.yaml"), "{}\n");
  EXPECT_TRUE(fs::is_empty(again.keys()));
  EXPECT_EQ(ReadTextFile(again.gateway() / "agents" / "1001.json"), "Anna");
  EXPECT_FALSE(fs::exists(again.gateway() / "ca.key"));
  EXPECT_FALSE(fs::exists(again.gateway() / "invites"));
  EXPECT_TRUE(fs::is_empty(again.logs()));
}

TEST_P(BackupTest, BringsKeysIfWantedReadableByTheirOwnerAlone) {
  BackUp(site, copy, true);
  Restore(copy, folder / "again");
  const fs::path key = folder / "again" / "keys" / "agent_4.key";
  EXPECT_EQ(ReadTextFile(key), "secret");
  EXPECT_EQ(fs::status(key).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_EQ(fs::status(key.parent_path()).permissions(), fs::perms::owner_all);
  EXPECT_EQ(ReadTextFile(folder / "again" / "gateway" / "ca.key"), "its key");
  EXPECT_EQ(fs::status(folder / "again" / "gateway").permissions(), fs::perms::owner_all);
  EXPECT_EQ(ReadTextFile(folder / "again" / "gateway" / "ca.pem"), "authority");
  EXPECT_FALSE(fs::exists(folder / "again" / "gateway" / "invites")) << "a code is good once";
}

// As the server that starts on the journal.
TEST_P(BackupTest, HasAllWholeEventsOfAJournalWithATornEnd) {
  const std::vector<StoredEvent> events = EventsOf(site);
  ASSERT_NE(events.size() % 10, 0U);  // a group has ten events
  // Cuts the last CHECKSUMS event
  fs::resize_file(site.journal(), fs::file_size(site.journal()) - 5);
  const auto bytes = static_cast<int64_t>(fs::file_size(site.journal()));
  const BackupSummary summary = BackUp(site, copy, false);
  EXPECT_GT(summary.lost_bytes, 0);
  EXPECT_EQ(summary.journal_bytes + summary.lost_bytes, bytes);
  EXPECT_EQ(Restore(copy, folder / "again").lost_bytes, 0);
  EXPECT_EQ(Restore(site.folder, folder / "restored").lost_bytes, summary.lost_bytes);
  EXPECT_EQ(EventsOf(ReadSite(folder / "again")), events);
  EXPECT_EQ(FoundAtOpening(ReadSite(folder / "again")), "");
}

TEST_P(BackupTest, EndsBehindTheLastGroupThatARunningServerHasWritten) {
  const std::vector<StoredEvent> events = EventsOf(site);
  fs::resize_file(site.journal(), fs::file_size(site.journal()) - 5);
  {
    const SiteLock lock(site);  // a server has it
    EXPECT_EQ(BackUp(site, copy, false).lost_bytes, 0);
  }
  EXPECT_EQ(Restore(copy, folder / "again").lost_bytes, 0);
  const std::vector<StoredEvent> kept = EventsOf(ReadSite(folder / "again"));
  ASSERT_FALSE(kept.empty());
  EXPECT_EQ(kept.size(), events.size() / 10 * 10);  // a group has ten events
  EXPECT_TRUE(std::equal(kept.begin(), kept.end(), events.begin()));
  EXPECT_EQ(FoundAtOpening(ReadSite(folder / "again")), "");
}

TEST_P(BackupTest, IsConsistentWhileTheJournalGrows) {
  Journal journal(site.journal(),
                  [](const std::string&, Bytes, const JournalPlace&) { return true; });
  std::jthread writer([&journal](const std::stop_token& stop) {
    const std::vector<uint8_t> data(30'000, 7);
    while (!stop.stop_requested() && journal.size() < 100'000'000) {
      journal.Append(1, "OTHER", data);
      journal.Sync();
    }
  });
  for (int i = 0; i < 5; ++i) {
    const fs::path again = folder / ("again_" + std::to_string(i));
    const fs::path to = folder / (std::to_string(i) + GetParam());
    const SiteLock lock(site);  // a server has it
    EXPECT_EQ(BackUp(site, to, false).lost_bytes, 0);
    Restore(to, again);
    EXPECT_EQ(FoundAtOpening(ReadSite(again)), "");
  }
}

TEST_P(BackupTest, OverwritesNothing) {
  BackUp(site, copy, false);
  EXPECT_THAT(WhyNot([&] { BackUp(site, copy, false); }), HasSubstr("nothing is overwritten"));
  EXPECT_THAT(WhyNot([&] { Restore(copy, site.folder); }), HasSubstr("nothing is overwritten"));
}

TEST_P(BackupTest, MakesNoFolderThatIsNamedAsAnArchive) {
  EXPECT_THAT(WhyNot([&] { BackUp(site, copy.string() + ".zip", false); }),
              HasSubstr("an archive is NAME.tar.zst"));
}

TEST_P(BackupTest, LeavesNothingOnAFullDisk) {
  EXPECT_THAT(OnFullDisk(300'000, [&] { BackUp(site, copy, false); }),
              HasSubstr("cannot be written"));
  BackUp(site, copy, false);
  EXPECT_THAT(OnFullDisk(300'000, [&] { Restore(copy, folder / "again"); }),
              HasSubstr("cannot be written"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 2);
}

TEST_P(BackupTest, SeesThatTheDiskKeptSomethingElse) {
  disk_lies = true;
  EXPECT_NE(WhyNot([&] { BackUp(site, copy, false); }), "");
  EXPECT_FALSE(disk_lies) << "nothing was written";
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
  BackUp(site, copy, false);
}

INSTANTIATE_TEST_SUITE_P(Kinds, BackupTest, testing::Values("copy.tar.zst", "copy"),
                         [](const auto& info) {
                           return std::string(info.param) == "copy" ? "Folder" : "Archive";
                         });

class ArchiveTest : public testing::Test {
 protected:
  const fs::path folder = FreshFolder("archive");
  const Site site = MakeSite(folder / "hall", WalksOf({1}));
  const fs::path file = folder / "hall.tar.zst";

  // Expects that the archive is refused and that no files are left; returns the message.
  std::string Refused() const {
    std::string why = WhyNot([&] { Restore(file, folder / "again"); });
    for (const auto& entry : fs::directory_iterator(folder)) {
      EXPECT_FALSE(entry.path().filename().string().starts_with("again")) << entry.path();
    }
    return why;
  }
};

TEST_F(ArchiveTest, IsRefusedWhenAnyByteIsOther) {
  BackUp(site, file, false);
  const std::string bytes = ReadTextFile(file);
  for (const size_t at : {size_t{0}, bytes.size() / 2, bytes.size() - 1}) {
    std::string other = bytes;
    other[at] = static_cast<char>(other[at] ^ 4);
    WriteTextFile(file, other);
    EXPECT_THAT(Refused(), HasSubstr("is no backup, or damaged")) << at;
  }
  WriteTextFile(file, bytes.substr(0, bytes.size() - 4));
  EXPECT_THAT(Refused(), HasSubstr("ends in the middle"));
}

TEST_F(ArchiveTest, WritesNothingOutsideTheSite) {
  const std::vector<uint8_t> data(3, 1);
  for (const char* name :
       {"site/../../evil", "/etc/evil", "site/keys/../evil.key", "site/lock", "site/keys/.key"}) {
    fs::remove(file);
    ArchiveFileWriter writer(file);
    writer.Begin(name, 3, 0600, 0);
    writer.Write(data);
    writer.Finish();
    EXPECT_THAT(Refused(), HasSubstr("is no file of a site")) << name;
  }
}

TEST_F(ArchiveTest, IsOneThatTarReads) {
  BackUp(site, file, false);
  if (std::system("command -v tar >/dev/null && command -v zstd >/dev/null") != 0) {
    GTEST_SKIP() << "no tar, or no zstd";
  }
  const std::string command = "cd " + folder.string() + " && tar --zstd -xf hall.tar.zst";
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(EventsOf(ReadSite(folder / "site")), EventsOf(site));
}

}  // namespace
}  // namespace pangea::site
