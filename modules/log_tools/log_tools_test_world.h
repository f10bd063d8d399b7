#pragma once

// The captured sample session, and a folder for what a test makes of it.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

namespace pangea {

inline const std::string kSample = std::string(PANGEA_SOURCE_DIR) + "/logs/two_walks/session.lcm";

class LogToolsTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("pangea_log_tools_") +
               testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  std::filesystem::path folder_;
};

}  // namespace pangea
