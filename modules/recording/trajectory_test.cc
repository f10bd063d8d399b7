#include "recording/trajectory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

namespace pangea {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class TrajectoryTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = ::testing::TempDir() + "pangea_trajectory_test/";
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  std::string Write(const std::string& text) {
    std::ofstream(folder_ + "file") << text;
    return folder_ + "file";
  }
  std::string folder_;
  std::vector<std::string> warnings_;
};

TEST_F(TrajectoryTest, UtimeRoundsDownOnBothSidesOfZero) {
  EXPECT_EQ(UtimeFromNs(1403636584763555584), 1403636584763555);
  EXPECT_EQ(UtimeFromNs(999), 0);
  EXPECT_EQ(UtimeFromNs(-1), -1);
  EXPECT_EQ(UtimeFromNs(-1000), -1);
}

TEST_F(TrajectoryTest, TumComesBackAsWritten) {
  std::mt19937_64 rng(3);
  std::normal_distribution<double> normal(0, 2);
  Trajectory written;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d t(normal(rng), normal(rng), normal(rng));
    const Eigen::Vector3d w(normal(rng), normal(rng), normal(rng));
    written.push_back({1403636584763555 + i * int64_t{49999}, Rigid3(ExpSo3(w), t)});
  }
  WriteTum(folder_ + "out.tum", written);
  const Trajectory read = ReadTrajectory(folder_ + "out.tum", &warnings_);
  ASSERT_EQ(read.size(), written.size());
  for (size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].utime, written[i].utime);
    EXPECT_LT(read[i].T.Minus(written[i].T).norm(), 1e-8);
  }
  EXPECT_THAT(warnings_, IsEmpty());
}

TEST_F(TrajectoryTest, StampsHaveSixDecimals) {
  EXPECT_THAT(ToTum({{1000007, Rigid3()}}), HasSubstr("1.000007 0.000000000 "));
  EXPECT_THAT(ToTum({{-7, Rigid3()}}), HasSubstr("-0.000007 "));
}

TEST_F(TrajectoryTest, ReadsBothGroundTruthWidths) {
  const std::string eight = Write("#stamp,...\n1000,1,2,3,0.5,0.5,0.5,0.5\n");
  const Trajectory a = ReadTrajectory(eight, &warnings_);
  ASSERT_EQ(a.size(), 1U);
  EXPECT_EQ(a[0].utime, 1);
  EXPECT_EQ(a[0].T.t, Eigen::Vector3d(1, 2, 3));
  const std::string seventeen = Write("1000, 1,2,3, 1,0,0,0, 4,5,6, 7,8,9, 10,11,12\n");
  EXPECT_EQ(ReadTrajectory(seventeen, &warnings_)[0].T.q.w(), 1.0);
  EXPECT_THAT(warnings_, IsEmpty());
}

// As editors and other programs save them.
TEST_F(TrajectoryTest, TellsTheFormatsApartByTheirRows) {
  const std::string tum = "2 1 2 3 0 0 0 1\n";
  const std::string euroc = "2000000000,1,2,3,1,0,0,0\n";
  for (const std::string& text :
       {"\xEF\xBB\xBF" + tum, "\xEF\xBB\xBF" + euroc, "\r\n" + euroc, " # a\n" + euroc,
        " # a, b\n" + tum, "stamp, x\n" + tum, "\xEF\xBB\xBF# a, b\n" + tum}) {
    const Trajectory read = ReadTrajectory(Write(text), &warnings_);
    ASSERT_EQ(read.size(), 1U) << text;
    EXPECT_EQ(read[0].utime, 2'000'000) << text;
    EXPECT_EQ(read[0].T.t, Eigen::Vector3d(1, 2, 3)) << text;
  }
  EXPECT_THAT(warnings_, IsEmpty());
}

TEST_F(TrajectoryTest, MendsRowsAndNamesThem) {
  std::string text = "# comment\n";
  for (int i = 0; i < 30; ++i) {
    text += std::to_string(i) + " 0 0 0 0 0 0 1\n";
  }
  text += "3 0 0 0 0 0 0 1\n29.5 0 0 0 0 0\n";
  EXPECT_EQ(ReadTum(Write(text), &warnings_).size(), 30U);
  EXPECT_THAT(warnings_, ElementsAre(HasSubstr("file:33: 6 columns instead of 8; row dropped"),
                                     HasSubstr("1 rows out of order; sorted"),
                                     HasSubstr("1 rows with a stamp already seen; dropped")));
}

TEST_F(TrajectoryTest, RefusesAnotherFormatAndNothing) {
  EXPECT_THROW(ReadTum(Write("1 2 3\n4 5 6\n"), &warnings_), std::runtime_error);
  EXPECT_THROW(ReadTum(Write("# empty\n"), &warnings_), std::runtime_error);
  EXPECT_THROW(ReadTum(folder_ + "absent", &warnings_), std::runtime_error);
  EXPECT_THROW(ReadTum(Write("0 0 0 0 0 0 0 0.2\n"), &warnings_), std::runtime_error);
}

// Programs write such rows where they have no pose.
TEST_F(TrajectoryTest, RowsWithoutAPoseAreDroppedAndNamed) {
  std::string rows;
  for (int i = 0; i < 30; ++i) {
    rows += std::to_string(i) + " 0 0 0 0 0 0 1\n";
  }
  const auto warning_of = [&](const std::string& row) -> std::string {
    std::vector<std::string> warnings;
    EXPECT_EQ(ReadTrajectory(Write(rows + row + "\n"), &warnings).size(), 30U) << row;
    EXPECT_EQ(warnings.size(), 1U) << row;
    return std::filesystem::path(warnings.at(0)).filename();
  };
  EXPECT_EQ(warning_of("30 0 nan 0 0 0 0 1"),
            "file:31: column 3 'nan' is not a finite number; row dropped");
  EXPECT_EQ(warning_of("30 0 0 -inf 0 0 0 1"),
            "file:31: column 4 '-inf' is not a finite number; row dropped");
  EXPECT_EQ(warning_of("30 0 0 0 0 0 0 1e400"),
            "file:31: column 8 '1e400' is not a finite number; row dropped");
  EXPECT_EQ(warning_of("inf 0 0 0 0 0 0 1"),
            "file:31: column 1 'inf' is not a finite number; row dropped");
  EXPECT_THAT(warning_of("30 1e300 0 0 0 0 0 1"),
              HasSubstr("file:31: column 2 '1e300' is not from"));
  EXPECT_EQ(warning_of("30 0 0 0 0 0 0 0"),
            "file:31: the quaternion has norm 0.000, not 1; row dropped");
  EXPECT_EQ(warning_of("30 0 x 0 0 0 0 1"),
            "file:31: column 3 'x' is not a finite number; row dropped");
}

// A filter that has no pose yet, for a third of the time: it is the right format.
TEST_F(TrajectoryTest, ManyRowsWithoutAPoseAreCounted) {
  for (const char* none : {" nan nan nan nan nan nan nan\n", " 0 0 0 0 0 0 0\n"}) {
    std::string rows;
    for (int i = 0; i < 30; ++i) {
      rows += std::to_string(i) + (i < 10 ? none : " 0 0 0 0 0 0 1\n");
    }
    std::vector<std::string> warnings;
    EXPECT_EQ(ReadTrajectory(Write(rows), &warnings).size(), 20U);
    ASSERT_EQ(warnings.size(), 7U) << "five by name";
    EXPECT_THAT(warnings[0], HasSubstr("file:1: "));
    EXPECT_THAT(warnings[6], HasSubstr("file: 10 of 30 rows have no pose; dropped"));
  }
  EXPECT_THROW(ReadTrajectory(Write("0 nan 0 0 0 0 0 1\n1 nan 0 0 0 0 0 1\n"), &warnings_),
               std::runtime_error);
}

TEST_F(TrajectoryTest, PositionsAloneAreReadWhereTheyAreEnough) {
  for (const std::string& text : {std::string("1 4 5 6\n2 1 2 nan\n3 1 2 3\n"),
                                  std::string("1000000000,4,5,6\n2000000000,1,2,nan\n"
                                              "3000000000,1,2,3\n")}) {
    const PosesOrPositions file = ReadPosesOrPositions(Write(text), &warnings_);
    EXPECT_FALSE(file.has_rotations);
    ASSERT_EQ(file.trajectory.size(), 2U);
    EXPECT_EQ(file.trajectory[1].utime, 3'000'000);
    EXPECT_EQ(file.trajectory[1].T.t, Eigen::Vector3d(1, 2, 3));
    EXPECT_EQ(file.trajectory[1].T.q.w(), 1);
    EXPECT_THROW(ReadTrajectory(Write(text), &warnings_), std::runtime_error);
  }
  EXPECT_TRUE(ReadPosesOrPositions(Write("2 1 2 3 0 0 0 1\n"), &warnings_).has_rotations);
  // Rows of either kind in one file: it has one format, and more than a tenth are of another.
  EXPECT_THROW(
      ReadPosesOrPositions(Write("1 2 3 4\n2 1 2 3 0 0 0 1\n3 1 2 3 0 0 0 1\n"), &warnings_),
      std::runtime_error);
}

TEST_F(TrajectoryTest, InterpolatesHalfwayInPositionAndRotation) {
  const Trajectory trajectory = {{0, Rigid3()},
                                 {100, Rigid3(YawRotation(0.8), {2, 0, -4})},
                                 {900, Rigid3(YawRotation(0.8), {2, 0, -4})}};
  const auto half = Interpolate(trajectory, 50, 100);
  ASSERT_TRUE(half);
  EXPECT_LT(half->Minus(Rigid3(YawRotation(0.4), {1, 0, -2})).norm(), 1e-12);
  EXPECT_TRUE(Interpolate(trajectory, 0, 0));
  EXPECT_TRUE(Interpolate(trajectory, 900, 0));
  EXPECT_FALSE(Interpolate(trajectory, 500, 100)) << "a gap is not bridged";
  EXPECT_FALSE(Interpolate(trajectory, -1, 1000));
  EXPECT_FALSE(Interpolate(trajectory, 901, 1000));
}

TEST_F(TrajectoryTest, PathLengthAddsUp) {
  EXPECT_DOUBLE_EQ(
      PathLength(
          {{0, {}}, {1, Rigid3({1, 0, 0, 0}, {3, 4, 0})}, {2, Rigid3({1, 0, 0, 0}, {3, 4, 2})}}),
      7.0);
}

}  // namespace
}  // namespace pangea
