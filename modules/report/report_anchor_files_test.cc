// Tests anchors from the logs to all three reports, and their picture.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "messages/anchor_messages.h"
#include "messages/channels.h"
#include "pangea/pose_t.hpp"
#include "report/report_test_world.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

const AnchorId kKettle{1, kOpened + 7};
const Eigen::Vector3d kPlace{4, 0, 10};  // above the walks; the cameras look up
const Eigen::Vector3d kOffset{0.03, 0, 0};
constexpr double kPlaced = 6;  // seconds of agent 1's recording

// A true position, seen in an agent's odom frame, at a time of its recording.
Rigid3 InOdom(int32_t agent, double s, const Eigen::Vector3d& p_truth) {
  Rigid3 T_odom_anchor;
  T_odom_anchor.t = Odometry(agent, s) * (Truth(agent, s).Inverse() * p_truth);
  return T_odom_anchor;
}

class ReportAnchorFiles : public ReportWorld {
 protected:
  void SetUp() override {
    ReportWorld::SetUp();
    LogBoth();
    LogState(State(1, {Map(1), Map(2)}, NumKeyframes()));
    log_->Write(std::string(channels::kAnchorEdit), ToMessage(Edit()));
    log_->Write(std::string(channels::kAnchorEdit), ToMessage(Edit()));  // a repeat
    WriteAgent(1);
    WriteAgent(2);
  }

  static AnchorEdit Edit() {
    AnchorEdit edit;
    edit.anchor = kKettle;
    edit.agent_id = 1;
    edit.right = AnchorRight::kEditOwn;
    edit.seq = 0;
    edit.name = "kettle <1>";
    edit.placement = AnchorEdit::Placement::kPixel;
    edit.map = Map(1);
    edit.utime = Utime(kPlaced);
    edit.pixel = {50, 50};
    return edit;
  }

  // Writes four poses per second of the log, so that most are long after the fusion.
  void WriteAgent(int32_t agent) {
    AgentRun& run = input_.agents[static_cast<size_t>(agent - 1)];
    run.bus_log = fmt::format("{}/with_anchors_{}.lcm", folder_, agent);
    LogWriter log(run.bus_log);
    AnchorState state;
    state.anchor = kKettle;
    state.revision = 1;
    state.edited_by = 1;
    state.name = "kettle <1>";
    state.map = Map(agent);
    state.group = Map(1);
    state.T_odom_anchor = InOdom(agent, agent == 1 ? kPlaced : kDuration, kPlace);
    for (double s = 0; s <= kDuration; s += 0.05) {
      pose_t pose{};
      pose.utime = Utime(s);
      pose.state = s < kInit ? pose_t::STATE_INITIALISING : pose_t::STATE_TRACKING;
      pose.map = ToMessage(Map(agent));
      pose.T_odom_body = pose.T_map_body = ToMessage(Odometry(agent, s));
      if (agent == 2 && s > kInit) {
        const ShownAnchor shown{kKettle, 1, InOdom(2, s, kPlace + kOffset)};
        log.Write(channels::ShownAnchors(2), ToMessage(ShownAnchors{Utime(s), Map(2), {shown}}));
      } else {
        log.Write(channels::Anchor(agent), ToMessage(state));
      }
      log.Write(channels::Pose(agent), pose);
    }
  }

  // Makes a folder with only ground truth a recording with images, one per second.
  void AddImages(int32_t agent) const {
    const std::string mav0 = Recording(agent) + "/mav0";
    const std::string identity =
        "T_BS:\n  rows: 4\n  cols: 4\n  data: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n";
    std::ofstream(mav0 + "/cam0/sensor.yaml")
        << identity
        << "camera_model: pinhole\nresolution: [100, 100]\nintrinsics: [100, 100, 50, 50]\n"
           "distortion_coefficients: [0, 0, 0, 0]\ndistortion_model: radial-tangential\n";
    std::ofstream(mav0 + "/imu0/sensor.yaml")
        << identity
        << "rate_hz: 200\ngyroscope_noise_density: 1e-4\ngyroscope_random_walk: 2e-5\n"
           "accelerometer_noise_density: 3e-3\naccelerometer_random_walk: 4e-3\n";
    std::ofstream imu(mav0 + "/imu0/data.csv");
    imu << "#t\n";
    for (int i = -20; i < 6100; ++i) {
      imu << fmt::format("{}000,0,0,0,0,0,9.81\n", Utime(0.005 * i));
    }
    fs::create_directories(mav0 + "/cam0/data");
    std::ofstream csv(mav0 + "/cam0/data.csv");
    csv << "#t\n";
    for (int i = 0; i <= 600; ++i) {
      const std::string file = fmt::format("{}000.png", Utime(0.05 * i));
      csv << fmt::format("{}000,{}\n", Utime(0.05 * i), file);
      cv::imwrite(mav0 + "/cam0/data/" + file, cv::Mat(100, 100, CV_8UC1, cv::Scalar(30)));
    }
  }
};

TEST_F(ReportAnchorFiles, AreInAllThreeReports) {
  input_.anchors = {{1, "kettle <1>"}, {2, "pot"}};
  input_.expect = {{"anchor_error_m", 0.1}};
  const json report = Report();
  ASSERT_EQ(report["anchors"].size(), 2U);
  const json& kettle = report["anchors"][0];
  EXPECT_EQ(kettle["name"], "kettle <1>");
  EXPECT_EQ(kettle["id"], ToString(kKettle));
  EXPECT_EQ(kettle["made_by"], 1);
  EXPECT_EQ(kettle["placed"], true);
  ASSERT_EQ(kettle["agents"].size(), 1U);
  const json& second = kettle["agents"][0];
  EXPECT_EQ(second["id"], 2);
  EXPECT_TRUE(second["reason"].is_null());
  for (const char* key :
       {"error_m", "error_at_fusion_m", "error_10s_m", "error_end_m", "error_max_m"}) {
    EXPECT_NEAR(second[key].get<double>(), 0.03, 2e-4) << key;
  }
  EXPECT_NEAR(second["error_px"].get<double>(), 0.03 * 100 / 10 * 6.4, 0.05);
  EXPECT_GT(second["largest_jump_m"].get<double>(), 0) << "the odometry's scale";
  EXPECT_FALSE(report["anchors"][1]["placed"]);
  EXPECT_EQ(report["anchors"][1]["agents"], json::array());
  EXPECT_EQ(report["expectations"][0]["met"], false) << "the pot was never placed";
  EXPECT_THAT(markdown_, HasSubstr("\n## Anchors\n\n"));
  EXPECT_THAT(markdown_, HasSubstr("| pot        | 2       | -     |"));
  EXPECT_THAT(markdown_, HasSubstr("never placed"));
  EXPECT_THAT(Text("report.html"), HasSubstr("kettle &lt;1&gt;"));
  EXPECT_FALSE(Exists("anchors.jpg")) << "the recordings have no images";
  EXPECT_THAT(markdown_, Not(HasSubstr("anchors.jpg")));
  EXPECT_THAT(report["notes"], Contains(HasSubstr("agent 1: no pictures of anchors: ")));
}

TEST_F(ReportAnchorFiles, ThePictureHasTheAnchorInBothViews) {
  AddImages(1);
  AddImages(2);
  Report();
  const cv::Mat picture = cv::imread(folder_ + "/out/anchors.jpg");
  ASSERT_EQ(picture.size(), cv::Size(1280, 670)) << "two images of 640 x 640, and their captions";
  const Eigen::Vector3d p_cam = Truth(1, kPlaced).Inverse() * kPlace;
  const Eigen::Vector2d pixel = 6.4 * (100 * p_cam.head<2>() / p_cam.z() + Eigen::Vector2d(50, 50));
  const auto at = picture.at<cv::Vec3b>(30 + static_cast<int>(std::lround(pixel.y())),
                                        static_cast<int>(std::lround(pixel.x())));
  EXPECT_GT(at[2], 150) << "the cross, orange";
  EXPECT_LT(at[0], 90);
  cv::Mat drawn;
  cv::inRange(picture(cv::Rect(640, 30, 640, 640)), cv::Scalar(150, 100, 0),
              cv::Scalar(255, 220, 140), drawn);
  EXPECT_GT(cv::countNonZero(drawn), 20) << "the circle of ground truth, blue";
  EXPECT_THAT(markdown_, HasSubstr("\n![Anchors](anchors.jpg)\n"));
  EXPECT_THAT(Text("report.html"), HasSubstr("src=\"data:image/jpeg;base64,/9j/"));
}

}  // namespace
}  // namespace pangea
