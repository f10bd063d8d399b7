// Runs the tests of one source file, e.g. `tests.files session_test.cc`; without a name, all that
// GoogleTest's flags choose.

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <string>

namespace {

// As --gtest_filter lists them; empty if the file has none.
std::string TestsOf(const std::string& file) {
  std::string tests;
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  for (int i = 0; i < all.total_test_suite_count(); ++i) {
    const testing::TestSuite& suite = *all.GetTestSuite(i);
    for (int k = 0; k < suite.total_test_count(); ++k) {
      const testing::TestInfo& test = *suite.GetTestInfo(k);
      if (std::filesystem::path(test.file()).filename() == file) {
        tests += std::string(suite.name()) + "." + test.name() + ":";
      }
    }
  }
  return tests;
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  if (argc > 1) {
    const std::string tests = TestsOf(argv[1]);
    if (tests.empty()) {
      std::fprintf(stderr, "no tests of %s\n", argv[1]);
      return 2;
    }
    testing::GTEST_FLAG(filter) = tests;
  }
  return RUN_ALL_TESTS();
}
