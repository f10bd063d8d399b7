// Tests what programs say of the BLAS that this machine has, with each of Debian's in turn.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "programs.h"

namespace pangea::tests {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// The folder with one of the alternatives of libblas.so.3; empty if it is not installed.
fs::path FolderOf(const std::string& alternative) {
  for (const auto& entry : fs::directory_iterator("/usr/lib")) {
    if (fs::exists(entry.path() / alternative / "libblas.so.3")) {
      return entry.path() / alternative;
    }
  }
  return {};
}

struct Alternative {
  const char* folder;
  const char* name;
  bool is_slow;
};

class EachBlas : public testing::TestWithParam<Alternative> {
 protected:
  void SetUp() override {
    folder_ = FolderOf(GetParam().folder);
    if (folder_.empty()) {
      GTEST_SKIP() << "this machine has no " << GetParam().folder << "/libblas.so.3";
    }
  }

  void ExpectNamed(const std::string& output) const {
    EXPECT_THAT(output, HasSubstr(fmt::format("BLAS: {}", GetParam().name)));
    EXPECT_THAT(output, HasSubstr((folder_ / "libblas.so.3").string()));
    const auto warning = AllOf(HasSubstr("WARNING"), HasSubstr("apt install libopenblas0-serial"),
                               HasSubstr(fmt::format("update-alternatives --auto libblas.so.3-{}\n",
                                                     folder_.parent_path().filename().string())));
    if (GetParam().is_slow) {
      EXPECT_THAT(output, warning);
    } else {
      EXPECT_THAT(output, Not(HasSubstr("WARNING")));
    }
  }

  fs::path folder_;
};

TEST_P(EachBlas, IsNamedByAProgramThatComputesWithIt) {
  ExpectNamed(
      RunCommand(fmt::format("LD_LIBRARY_PATH={} pangea-posegraph --version", folder_.string()))
          .output);
}

// pangea-server itself links none.
TEST_P(EachBlas, IsNamedByTheServerAndByItsProcesses) {
  const fs::path work = FreshFolder(fmt::format("blas_{}", GetParam().folder));
  fs::create_directory(work / "keys");
  const int port = 20000 + getpid() % 6000 * 2;
  const auto url = [](int p) { return fmt::format("'udpm://239.255.76.67:{}?ttl=0'", p); };
  ExpectNamed(RunCommand(fmt::format("LD_LIBRARY_PATH={0} timeout -s INT 3 pangea-server --bus {1} "
                                     "--link {2} --journal {3}/map.lcm --keys {3}/keys",
                                     folder_.string(), url(port), url(port + 1), work.string()))
                  .output);
  ExpectNamed(ReadFile(work / "map.lcm.logs" / "global_ba.txt"));
  fs::remove_all(work);
}

INSTANTIATE_TEST_SUITE_P(Debian, EachBlas,
                         testing::Values(Alternative{"atlas", "ATLAS", true},
                                         Alternative{"blas", "reference BLAS", true},
                                         Alternative{"openblas-serial", "OpenBLAS 0", false},
                                         Alternative{"openblas-pthread", "OpenBLAS 0", false}));

// Debian's Ceres names ATLAS as a library to link, which would come before the machine's BLAS.
TEST(Blas, NoProgramLinksOneByName) {
  int programs = 0;
  for (const auto& entry : fs::directory_iterator(PANGEA_BINARY_DIR "/bin")) {
    const std::string libraries = RunCommand("ldd " + entry.path().string()).output;
    EXPECT_THAT(libraries, Not(HasSubstr("libf77blas"))) << entry.path();
    programs += libraries.find("libcholmod") != std::string::npos ? 1 : 0;
  }
  EXPECT_GE(programs, 4) << "of posegraph, global_ba, session, site, log";
}

// With two threads OpenBLAS gives other bits.
TEST(Blas, WithThreadsGivesTheBytesOfTheSerialOne) {
  const fs::path serial = FolderOf("openblas-serial"), threads = FolderOf("openblas-pthread");
  if (serial.empty() || threads.empty()) {
    GTEST_SKIP() << "this machine has not both OpenBLAS libraries";
  }
  const fs::path work = FreshFolder("blas_threads");
  for (const fs::path& folder : {serial, threads}) {
    const Outcome outcome = RunCommand(
        fmt::format("LD_LIBRARY_PATH={} OPENBLAS_NUM_THREADS=2 pangea-session replay {} --out {}",
                    folder.string(), kSample, (work / folder.filename()).string()));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
    EXPECT_THAT(outcome.output, HasSubstr(folder.string()));
  }
  const auto log = [&](const fs::path& folder) {
    return ReadFile(work / folder.filename() / "session.lcm");
  };
  EXPECT_TRUE(log(serial) == log(threads));
  fs::remove_all(work);
}

}  // namespace
}  // namespace pangea::tests
