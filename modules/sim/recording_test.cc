#include "sim/recording.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>

#include "recording/euroc.h"
#include "recording/trajectory.h"
#include "sim/random.h"
#include "sim/scene/test_scenes.h"

namespace pangea::sim {
namespace {

namespace fs = std::filesystem;

class Recording : public testing::Test {
 protected:
  void SetUp() override {
    root_ = fs::path(testing::TempDir()) /
            fmt::format("pangea_sim_{}_{}",
                        testing::UnitTest::GetInstance()->current_test_info()->name(), getpid());
    fs::create_directories(root_);
  }
  void TearDown() override { fs::remove_all(root_); }

  // A recording of half a second in a small coarse room.
  RecordingOptions Small(const std::string& name) const {
    RecordingOptions options;
    options.out = (root_ / name).string();
    options.generated.duration_s = 0.7;
    options.scene.kind = SceneKind::kRoom;
    options.scene.coarseness = 8;
    options.camera = Shrunk(EurocCamera(), 4);
    return options;
  }

  // Every file below a folder with the hash of its bytes.
  static std::map<std::string, uint64_t> Files(const std::string& folder) {
    std::map<std::string, uint64_t> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (entry.is_regular_file()) {
        std::ifstream file(entry.path(), std::ios::binary);
        const std::string bytes{std::istreambuf_iterator<char>(file),
                                std::istreambuf_iterator<char>()};
        files[fs::relative(entry.path(), folder).string()] = HashBytes(bytes.data(), bytes.size());
      }
    }
    return files;
  }

  fs::path root_;
};

TEST_F(Recording, IsReadAsEuRoCWithoutAWarning) {
  const RecordingOptions options = Small("a");
  const RecordingSummary summary = RenderRecording(options);
  const EurocRecording recording(options.out);
  EXPECT_TRUE(recording.warnings().empty()) << recording.warnings().front();
  EXPECT_EQ(recording.images().size(), summary.images);
  EXPECT_EQ(recording.images().size(), 10u);
  EXPECT_EQ(recording.imu().size(), recording.ground_truth().size());
  EXPECT_EQ(recording.imu()[1].utime, recording.images()[0].utime);
  EXPECT_NEAR(recording.camera().fx, options.camera.fx, 1e-6);
  EXPECT_LT(recording.camera().T_body_cam.Minus(options.camera.T_body_cam).norm(), 1e-9);
  std::string why;
  EXPECT_FALSE(recording.LoadImage(0, &why).empty()) << why;
}

TEST_F(Recording, IsNoneUntilItIsComplete) {
  const RecordingOptions options = Small("a");
  const auto interrupt = [](size_t done, size_t) {
    if (done == 4) {
      throw std::runtime_error("interrupted");
    }
  };
  EXPECT_THROW(RenderRecording(options, interrupt), std::runtime_error);
  EXPECT_FALSE(fs::exists(options.out + "/mav0"));
  RenderRecording(options);
  EXPECT_EQ(EurocRecording(options.out).images().size(), 10u);
  EXPECT_FALSE(fs::exists(options.out + "/mav0.partial"));
  EXPECT_THROW(RenderRecording(options), std::runtime_error) << "it is there already";
}

TEST_F(Recording, WithoutAnImageIsRefused) {
  RecordingOptions options = Small("a");
  options.duration_s = 0.005;
  EXPECT_THROW(RenderRecording(options), std::runtime_error);
  EXPECT_FALSE(fs::exists(options.out));
}

TEST_F(Recording, NeedsNoCacheThatCannotBeMade) {
  RecordingOptions options = Small("a");
  options.cache_dir = "/proc/cache";
  EXPECT_EQ(RenderRecording(options).rendered, 10u);
}

TEST_F(Recording, SameSeedSameBytesOnAnyThreadsWithAndWithoutCache) {
  RecordingOptions options = Small("a");
  options.threads = 1;
  options.tracks = true;
  RenderRecording(options);
  const auto files = Files(options.out);
  options.out = (root_ / "b").string();
  options.threads = 3;
  options.cache_dir = (root_ / "cache").string();
  EXPECT_EQ(RenderRecording(options).rendered, 10u);
  EXPECT_EQ(Files(options.out), files);
  options.out = (root_ / "c").string();
  EXPECT_EQ(RenderRecording(options).rendered, 0u);
  EXPECT_EQ(Files(options.out), files);

  options.out = (root_ / "d").string();
  options.seed = 2;
  EXPECT_EQ(RenderRecording(options).rendered, 0u);  // only the noise is new
  for (const auto& [name, hash] : Files(options.out)) {
    const bool noisy = name.ends_with(".png") || name == "mav0/imu0/data.csv" ||
                       name == "mav0/state_groundtruth_estimate0/data.csv";  // biases
    EXPECT_EQ(hash != files.at(name), noisy) << name;
  }
}

TEST_F(Recording, PerfectOnesDependOnNoSeed) {
  RecordingOptions options = Small("a");
  options.perfect = true;
  RenderRecording(options);
  const auto files = Files(options.out);
  options.out = (root_ / "b").string();
  options.seed = 9;
  RenderRecording(options);
  EXPECT_EQ(Files(options.out), files);
}

TEST_F(Recording, ARecordedImuStandsBesideImagesAtItsStamps) {
  RecordingOptions options = Small("a");
  const Trajectory path = LivelyPath(2);
  WriteTum((root_ / "path.tum").string(), path);
  options.path_file = (root_ / "path.tum").string();
  options.imu_file = (root_ / "imu.csv").string();
  options.stamps_file = (root_ / "stamps.txt").string();
  const int64_t origin_ns = 1000 * path.front().utime;
  std::ofstream imu(options.imu_file);
  imu << "#timestamp [ns],wx,wy,wz,ax,ay,az\n";
  for (int i = 60; i < 400; ++i) {
    imu << origin_ns + i * 5'000'000LL << ",0.1,0.2,0.3,0,0,9.8" << i << "\n";
  }
  imu.close();
  std::ofstream stamps(options.stamps_file);
  for (int i = -3; i < 60; ++i) {
    stamps << origin_ns + i * 50'000'000LL << "\n";
  }
  stamps.close();
  RenderRecording(options);
  const EurocRecording recording(options.out);
  EXPECT_TRUE(recording.warnings().empty()) << recording.warnings().front();
  // From the first IMU row on (0.3 s), and inside the path (until 0.1 s before 2 s).
  EXPECT_EQ(recording.images().front().stamp_ns, origin_ns + 300'000'000);
  EXPECT_EQ(recording.images().back().stamp_ns, origin_ns + 1'900'000'000);
  EXPECT_DOUBLE_EQ(recording.imu().front().accel.z(), 9.860);
  const auto truth = Interpolate(recording.ground_truth(), recording.images()[5].utime, 10'000);
  ASSERT_TRUE(truth);
  const auto expected = Interpolate(path, recording.images()[5].utime, 10'000);
  EXPECT_LT(truth->Minus(*expected).norm(), 1e-3);
}

TEST_F(Recording, RefusesWithOneLine) {
  RecordingOptions options = Small("a");
  options.start_s = 5;
  EXPECT_THROW(RenderRecording(options), std::runtime_error);
  options = Small("a");
  RenderRecording(options);
  EXPECT_THROW(RenderRecording(options), std::runtime_error);  // holds a recording already
}

}  // namespace
}  // namespace pangea::sim
