// The agent with a server's end of the link beside it; no images.

#include "phone/agent/phone_agent.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>

#include "agent_handler/agent_handler_process.h"
#include "link/agent_key.h"
#include "messages/encoding.h"
#include "messages/testing/test_anchors.h"
#include "messages/testing/test_keyframes.h"
#include "phone/agent/test_agent_texts.h"

namespace pangea::phone {
namespace {

const MapId kOldMap{7, kStart_us - 60'000'000};
const MapId kLaterMap{7, kStart_us + 60'000'000};  // of an earlier run, when the clock was wrong

int64_t Refused(const status_t& status, const std::string& reason) {
  for (const counter_t& counter : status.refused) {
    if (counter.name == reason) {
      return counter.count;
    }
  }
  return 0;
}

// A server that has the agent's key.
class PhoneAgentTest : public testing::Test {
 protected:
  explicit PhoneAgentTest(const AgentTexts& texts = Texts()) : agent_(ReadAgentConfig(texts)) {}
  void SetUp() override {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_ / "keys");
    const std::filesystem::path file = folder_ / "keys" / KeyFileName(7);
    std::ofstream(file) << "agent: 7\nkey: " << kKeyHex << "\n";
    std::filesystem::permissions(file, std::filesystem::perms::owner_read);
    handler_.emplace(link_bus_, server_bus_, (folder_ / "journal.lcm").string(),
                     (folder_ / "keys").string(), now_us_, AgentHandlerOptions{});
    link_bus_.Subscribe("LINK_DOWN_7",
                        [this](const std::string&, Bytes packet) { agent_.OnLinkDown(packet); });
    server_bus_.Subscribe("KEYFRAME_7", [this](const std::string&, Bytes data) {
      delivered_.emplace_back(data.begin(), data.end());
    });
  }
  void TearDown() override {
    handler_.reset();
    std::filesystem::remove_all(folder_);
  }

  void Run(double seconds) {
    for (const int64_t end = now_us_ + static_cast<int64_t>(1e6 * seconds); now_us_ < end;
         now_us_ += 10'000) {
      agent_.Poll(now_us_);
      const PhoneEvents events = agent_.Take();
      for (const std::vector<uint8_t>& packet : events.link_up) {
        link_bus_.Publish("LINK_UP_7", packet);
      }
      spool_.insert(spool_.end(), events.spool.begin(), events.spool.end());
      keyframes_ += events.keyframes.size();
      anchors_ = events.anchors ? events.anchors : anchors_;
      others_ = events.others ? events.others : others_;
      uplink_status_ = events.uplink_status ? events.uplink_status : uplink_status_;
      vio_status_ = events.vio_status ? events.vio_status : vio_status_;
      pose_ = events.pose ? events.pose : pose_;
      link_bus_.Drain();
      handler_->Poll(now_us_);
      handler_->Tick(now_us_);
      link_bus_.Drain();
      server_bus_.Drain();
    }
  }

  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / "pangea_phone_agent";
  int64_t now_us_ = kStart_us;
  PhoneAgent agent_;
  LocalBus link_bus_, server_bus_;
  std::optional<AgentHandlerProcess> handler_;
  std::vector<std::vector<uint8_t>> delivered_;
  std::vector<SpoolChange> spool_;
  std::optional<std::vector<DrawnAnchor>> anchors_;
  std::optional<Others> others_;
  std::optional<status_t> uplink_status_, vio_status_;
  std::optional<PhonePose> pose_;
  size_t keyframes_ = 0;
};

TEST_F(PhoneAgentTest, KeyframesOfAnEarlierRunReachTheServerAndAreDeletedThen) {
  std::vector<std::string> ids;
  for (int32_t seq = 0; seq < 3; ++seq) {
    const KeyframeId id{kOldMap, seq};
    ids.push_back(ToString(id));
    agent_.Restore(ids.back(), EncodeTestKeyframe(id));
  }
  Run(3);
  ASSERT_EQ(delivered_.size(), 3u);
  for (int32_t seq = 0; seq < 3; ++seq) {
    EXPECT_EQ(delivered_[seq], EncodeTestKeyframe({kOldMap, seq}));
  }
  ASSERT_EQ(spool_.size(), 3u);  // and none was put again
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(spool_[i].id, ids[i]);
    EXPECT_TRUE(spool_[i].bytes.empty());
  }
  EXPECT_EQ(keyframes_, 0u);
  ASSERT_TRUE(uplink_status_);
  EXPECT_EQ(CounterOf(*uplink_status_, "keyframes_acked"), 3);
}

TEST_F(PhoneAgentTest, WithoutAServerNothingIsDeleted) {
  agent_.Restore("a", EncodeTestKeyframe({kOldMap, 0}));
  for (; now_us_ < kStart_us + 5'000'000; now_us_ += 10'000) {
    agent_.Poll(now_us_);
  }
  const PhoneEvents events = agent_.Take();
  EXPECT_TRUE(events.spool.empty());
  EXPECT_GE(events.link_up.size(), 5u);  // hellos
  ASSERT_TRUE(events.uplink_status);
  EXPECT_EQ(CounterOf(*events.uplink_status, "spool"), 1);
}

TEST_F(PhoneAgentTest, ADamagedKeyframeIsDeletedAndAnothersIsLeft) {
  std::vector<uint8_t> damaged = EncodeTestKeyframe({kOldMap, 0});
  damaged[3] ^= 1;
  agent_.Restore("damaged", damaged);
  agent_.Restore("another's", EncodeTestKeyframe({{8, 1000}, 0}));
  Run(2);
  ASSERT_EQ(spool_.size(), 1u);
  EXPECT_EQ(spool_[0].id, "damaged");
  EXPECT_TRUE(spool_[0].bytes.empty());
  EXPECT_TRUE(delivered_.empty());
}

TEST_F(PhoneAgentTest, AnchorsOfTheServerAreDrawnAndRemoved) {
  agent_.Restore("a", EncodeTestKeyframe({kOldMap, 0}));
  Run(2);
  const AnchorId id{3, 1000};
  PublishMessage(server_bus_, "ANCHOR_7", ToMessage(TestAnchor(id, 1, kOldMap)));
  Run(3);
  ASSERT_TRUE(anchors_ && anchors_->size() == 1);
  const DrawnAnchor& drawn = anchors_->front();
  EXPECT_EQ(drawn.id, id);
  EXPECT_EQ(drawn.name, "kettle");
  EXPECT_NEAR(drawn.sigma_m, 0.01, 1e-6);
  EXPECT_LT((drawn.T_odom_anchor.t - Eigen::Vector3d(1, 2, 3)).norm(), 1e-3);
  agent_.RemoveAnchor(id);
  agent_.RemoveAnchor({3, 1001});  // there is none
  Run(3);
  EXPECT_EQ(CounterOf(*uplink_status_, "anchor_edits"), 1);
}

TEST_F(PhoneAgentTest, ItHearsWhereTheOthersAre) {
  agent_.Restore("a", EncodeTestKeyframe({kOldMap, 0}));
  Run(2);
  PublishMessage(server_bus_, "OTHERS_7", ToMessage(Others{kOldMap, {{3, {}}, {4, {}}}}));
  Run(0.5);
  ASSERT_TRUE(others_);
  EXPECT_EQ(others_->map, kOldMap);
  ASSERT_EQ(others_->others.size(), 2u);
  EXPECT_EQ(others_->others[1].agent_id, 4);
}

TEST_F(PhoneAgentTest, ACorrectionOfAnotherRunsMapLeavesTheGroupOfThisOne) {
  const MapId map{7, kStart_us};
  const auto pose_at = [this](int64_t utime) {
    agent_.AddImage(utime, cv::Mat(48, 64, CV_8U, cv::Scalar(0)));
    for (int64_t t = utime - 50'000; t <= utime + 50'000; t += 10'000) {
      agent_.AddImu({.utime = t, .accel = {0, 0, kGravity}});
    }
    Run(0.1);
    return pose_;
  };
  for (const MapId& known : {kOldMap, kLaterMap, map}) {
    agent_.Restore(ToString(known), EncodeTestKeyframe({known, 0}));
  }
  Run(2);
  pose_at(1'000'000);  // opens the map
  const Eigen::Matrix<double, 6, 6> covariance = 1e-4 * Eigen::Matrix<double, 6, 6>::Identity();
  for (const auto& [corrected, revision] :
       {std::pair(map, 3), std::pair(kOldMap, 9), std::pair(kLaterMap, 9)}) {
    Correction correction;
    correction.map = corrected;
    correction.group = kOldMap;
    correction.revision = revision;
    correction.covariance = covariance;
    Run(1);
    PublishMessage(server_bus_, "CORRECTION_7", ToMessage(correction));
  }
  // The server tells all, again and again.
  for (int64_t utime = 1'100'000; utime < 3'000'000; utime += 50'000) {
    const std::optional<PhonePose> pose = pose_at(utime);
    ASSERT_TRUE(pose && pose->utime == utime) << utime;
    EXPECT_EQ(pose->map, map);
    ASSERT_TRUE(pose->in_group) << utime;
    EXPECT_EQ(pose->in_group->group, kOldMap);
  }
}

TEST(PhoneAgentWithDevicePoses, GivesPosesAndKeyframes) {
  AgentTexts texts = Texts();
  texts.device_poses = true;
  PhoneAgent agent(ReadAgentConfig(texts));
  auto add = [&agent, utime = int64_t{0}](const std::optional<Rigid3>& T) mutable {
    agent.AddImage(utime += 100'000, cv::Mat(48, 64, CV_8U, cv::Scalar(0)), T);
    agent.Poll(kStart_us + utime);
    return agent.Take();
  };
  size_t keyframes = 0;
  for (int i = 0; i < 20; ++i) {
    const PhoneEvents events = add(Rigid3{Eigen::Quaterniond::Identity(), {0.1 * i, 0, 1.5}});
    ASSERT_TRUE(events.pose);
    EXPECT_EQ(events.pose->state, pose_t::STATE_TRACKING);
    EXPECT_EQ(events.pose->map, (MapId{7, kStart_us}));
    EXPECT_NEAR(events.pose->T_odom_body.t.x(), 0.1 * i, 1e-9);
    keyframes += events.keyframes.size();
    EXPECT_EQ(events.spool.size(), events.keyframes.size());
    EXPECT_EQ(events.camera.has_value(), !events.keyframes.empty());
  }
  EXPECT_GE(keyframes, 5u);
  EXPECT_EQ(add(std::nullopt).pose->state, pose_t::STATE_LOST);
  agent.StartAnew();
  EXPECT_EQ(add(Rigid3{}).pose->map, (MapId{7, kStart_us + 1}));
}

// Nobody would ever show it.
TEST(PhoneAgentWithoutServer, PlacesNoAnchor) {
  AgentTexts texts = Texts();
  texts.device_poses = true;
  texts.key_hex = "";
  PhoneAgent agent(ReadAgentConfig(texts));
  agent.AddImage(100'000, cv::Mat(48, 64, CV_8U, cv::Scalar(0)), Rigid3{});
  agent.Poll(kStart_us);
  ASSERT_EQ(agent.Take().pose->state, pose_t::STATE_TRACKING);
  EXPECT_THROW(agent.PlaceAnchor({"kettle", "", 100'000, Eigen::Vector2d(9, 9), {}}),
               std::runtime_error);
}

class PhoneAgentWithDevicePosesTest : public PhoneAgentTest {
 protected:
  PhoneAgentWithDevicePosesTest() : PhoneAgentTest(WithDevicePoses()) {}
  static AgentTexts WithDevicePoses() {
    AgentTexts texts = Texts();
    texts.device_poses = true;
    return texts;
  }
  void AddPose(int64_t utime, const std::optional<Rigid3>& T) {
    agent_.AddImage(utime, cv::Mat(48, 64, CV_8U, cv::Scalar(0)), T);
    Run(0.1);
  }
};

// The visitor tapped, the map ended, another began, and then the anchor got its name.
TEST_F(PhoneAgentWithDevicePosesTest, AnAnchorIsPlacedInTheMapOfItsImage) {
  std::optional<AnchorEdit> placed;
  server_bus_.Subscribe("ANCHOR_EDIT", [&](const std::string&, Bytes data) {
    anchor_edit_t message{};
    ASSERT_TRUE(DecodeMessage(data, &message));
    placed = Parse(message).value;
  });
  int64_t utime = 0;
  for (int i = 0; i < 10; ++i) {
    AddPose(utime += 100'000, Rigid3{Eigen::Quaterniond::Identity(), {0.1 * i, 0, 1.5}});
  }
  const int64_t tapped = utime;
  AddPose(utime += 100'000, std::nullopt);
  EXPECT_THROW(agent_.PlaceAnchor({"lost", "", utime, Eigen::Vector2d(9, 9), {}}),
               std::runtime_error);
  agent_.StartAnew();
  for (int i = 0; i < 10; ++i) {
    AddPose(utime += 100'000, Rigid3{Eigen::Quaterniond::Identity(), {0.1 * i, 0, 1.5}});
  }
  ASSERT_EQ(pose_->map, (MapId{7, kStart_us + 1}));
  agent_.PlaceAnchor({"kettle", "", tapped, Eigen::Vector2d(9, 9), {}});
  Run(15);
  ASSERT_TRUE(placed);
  EXPECT_EQ(placed->map, (MapId{7, kStart_us}));
  agent_.PlaceAnchor({"cup", "", utime, Eigen::Vector2d(9, 9), {}});
  Run(15);
  EXPECT_EQ(placed->map, (MapId{7, kStart_us + 1}));
}

// The visitor placed anchors without a network, closed the page, and opens it again.
TEST_F(PhoneAgentWithDevicePosesTest, AnchorsOfAnEarlierRunReachTheServerAndAreDeletedThen) {
  PhoneAgent earlier(ReadAgentConfig(WithDevicePoses()));
  std::map<std::string, std::vector<uint8_t>> stored;
  std::vector<std::string> order;
  const auto store = [&] {
    for (SpoolChange& change : earlier.Take().spool) {
      std::erase(order, change.id);
      if (!change.bytes.empty()) {
        order.push_back(change.id);
      }
      stored[change.id] = std::move(change.bytes);
    }
  };
  int64_t utime = 0;
  for (int i = 0; i < 10; ++i) {
    earlier.AddImage(utime += 100'000, cv::Mat(48, 64, CV_8U, cv::Scalar(0)),
                     Rigid3{Eigen::Quaterniond::Identity(), {0.1 * i, 0, 1.5}});
    earlier.Poll(kStart_us + utime);
  }
  const AnchorId kettle = earlier.PlaceAnchor({"kettle", "", utime - 300'000, {}, Rigid3()});
  store();  // the page may be killed at any time
  EXPECT_EQ(std::count(order.begin(), order.end(), "anchor " + ToString(kettle)), 1);
  earlier.PlaceAnchor({"cup", "a", utime, Eigen::Vector2d(9, 9), {}});
  earlier.Flush();
  store();
  std::map<AnchorId, AnchorEdit> placed;
  server_bus_.Subscribe("ANCHOR_EDIT", [&](const std::string&, Bytes data) {
    anchor_edit_t message{};
    ASSERT_TRUE(DecodeMessage(data, &message));
    const AnchorEdit edit = *Parse(message).value;
    placed[edit.anchor] = edit;
  });
  for (const std::string& id : order) {
    agent_.Restore(id, stored[id]);
  }
  Run(3);
  ASSERT_EQ(placed.size(), 2u);
  EXPECT_EQ(placed[kettle].name, "kettle");
  EXPECT_EQ(placed[kettle].map, (MapId{7, kStart_us}));
  for (const auto& [id, edit] : placed) {
    EXPECT_TRUE(edit.T_odom_body) << edit.name;
  }
  for (const SpoolChange& change : spool_) {
    stored[change.id] = change.bytes;
  }
  for (const auto& [id, bytes] : stored) {
    EXPECT_TRUE(bytes.empty()) << id;
  }
}

TEST_F(PhoneAgentTest, ADamagedEditIsDeletedAndAnothersIsLeft) {
  std::vector<uint8_t> damaged = EncodeMessage(ToMessage(TestEdit({7, 1}, 1, 7)));
  damaged.resize(damaged.size() / 2);
  agent_.Restore("damaged", damaged);
  agent_.Restore("another's", EncodeMessage(ToMessage(TestEdit({8, 1}, 1, 8))));
  Run(2);
  ASSERT_EQ(spool_.size(), 1u);
  EXPECT_EQ(spool_[0].id, "damaged");
  EXPECT_TRUE(spool_[0].bytes.empty());
}

TEST_F(PhoneAgentTest, AnImageOfAnotherSizeIsRefusedAndCountedAndThePoseSaysWhy) {
  agent_.AddImage(1'000, cv::Mat(10, 10, CV_8U, cv::Scalar(0)));
  Run(2);
  ASSERT_TRUE(vio_status_);
  const std::string why = "10x10 pixels, but the calibration is of 64x48";
  EXPECT_EQ(Refused(*vio_status_, "image: " + why), 1);
  ASSERT_TRUE(pose_);
  EXPECT_EQ(pose_->state, pose_t::STATE_INITIALISING);
  EXPECT_EQ(pose_->reason, why);
}

TEST_F(PhoneAgentTest, AnAnchorNeedsAPose) {
  EXPECT_THROW(agent_.PlaceAnchor({"kettle", "", 1000, Eigen::Vector2d(1, 1), {}}),
               std::runtime_error);
}

}  // namespace
}  // namespace pangea::phone
