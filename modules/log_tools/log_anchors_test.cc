// `pangea-log anchors`: the table, JSON, and glTF, whose structure is checked against glTF 2.0.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sodium.h>

#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "files/text_file.h"
#include "log_file/log_reader.h"
#include "log_file/log_writer.h"
#include "log_tools/anchors_gltf.h"
#include "log_tools/log_anchors.h"
#include "log_tools/log_export.h"
#include "log_tools/log_tools_test_world.h"
#include "messages/anchor_messages.h"
#include "messages/encoding.h"
#include "pangea/options_t.hpp"

namespace pangea {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;
using testing::SizeIs;

const MapId kMap{1, 1'795'251'811'384'046};  // the sample's, whose odom frame is the map frame
const std::string kPayload = R"({"model": "kettle.glb", "scale": 2})";
constexpr AnchorId kKettle{1, 10}, kDoor{0, 20}, kOld{2, 30};

AnchorEdit EditOf(const AnchorId& id, const std::string& name, int64_t seq) {
  AnchorEdit edit;
  edit.anchor = id;
  edit.agent_id = id.agent_id;
  edit.right = AnchorRight::kEditAll;
  edit.seq = seq;
  edit.name = name;
  edit.placement = AnchorEdit::Placement::kKeyframe;
  edit.map = kMap;
  edit.keyframe_seq = 3;
  return edit;
}

AnchorState StateOf(const AnchorId& id, const std::string& name, const Eigen::Vector3d& t) {
  AnchorState state;
  state.anchor = id;
  state.revision = 1;
  state.edited_by = id.agent_id;
  state.name = name;
  state.map = state.group = kMap;
  state.group_revision = 7;
  state.T_odom_anchor = {YawRotation(0.5), t};
  state.covariance = Vector6d(1e-4, 1e-4, 4e-4, 1e-6, 1e-6, 1e-6).asDiagonal();
  return state;
}

// The sample session, followed by messages as of its anchors process.
class LogAnchorsTest : public LogToolsTest {
 protected:
  void WriteEdits(LogFileWriter& log) {
    AnchorEdit kettle = EditOf(kKettle, "kettle", 0);
    kettle.payload = kPayload;
    Write(log, "ANCHOR_EDIT", kettle);
    Write(log, "ANCHOR_EDIT", EditOf(kDoor, "door", 1));
    AnchorEdit deleted = EditOf(kOld, "old", 2);
    Write(log, "ANCHOR_EDIT", deleted);
    deleted.seq = 3;
    deleted.revision = 2;
    deleted.deleted = true;
    Write(log, "ANCHOR_EDIT", deleted);
  }
  void WriteStates(LogFileWriter& log) {
    AnchorState kettle = StateOf(kKettle, "kettle", {9, 9, 9});
    kettle.payload = kPayload;
    Write(log, "ANCHOR", kettle);
    kettle.T_odom_anchor.t = {1, 2, 3};
    Write(log, "ANCHOR", kettle);
    AnchorState old = StateOf(kOld, "old", {5, 5, 5});
    old.revision = 2;
    old.gone = true;
    Write(log, "ANCHOR", old);
  }
  std::string Session() {
    std::string path = Path("session.lcm");
    LogFileWriter log(path);
    ReadLog(kSample, [&](const LogEvent& event) {
      log.Write(utime_ = event.utime, event.channel, event.data);
    });
    WriteEdits(log);
    WriteStates(log);
    return path;
  }
  std::string Journal() {
    std::string path = Path("journal.lcm");
    LogFileWriter log(path);
    WriteEdits(log);
    return path;
  }

  void Write(LogFileWriter& log, const std::string& channel, const auto& value) {
    log.Write(++utime_, channel, EncodeMessage(ToMessage(value)));
  }

  int64_t utime_ = 1'795'251'811'000'000;
};

TEST_F(LogAnchorsTest, TheTableHasTheNewest) {
  const std::string log = Session();
  const LoggedAnchors logged = ReadAnchors(log);
  EXPECT_EQ(logged.num_refused, 0);
  ASSERT_THAT(logged.anchors, SizeIs(3));
  EXPECT_NEAR(RmsPositionSigma(*logged.anchors.at(kKettle).state), std::sqrt(2e-4), 1e-6);
  const std::string text = ToText(logged, log);
  EXPECT_THAT(text,
              testing::ContainsRegex("1/10 +agent 1 +1 placed +1/1795251811384046 +1.000 2.000 "
                                     "3.000 +0.014 +35  kettle\n"));
  EXPECT_THAT(text, testing::ContainsRegex("0/20 +server +1 edited +0  door\n"));
  EXPECT_THAT(text, testing::ContainsRegex("2/30 +agent 2 +2 deleted +0  old\n"));
  EXPECT_THAT(text, Not(HasSubstr("replay")));
}

TEST_F(LogAnchorsTest, AJournalHasEditsOnlyAndSaysSo) {
  const std::string log = Journal();
  const LoggedAnchors logged = ReadAnchors(log);
  EXPECT_TRUE(logged.edits_only());
  const std::string text = ToText(logged, log);
  EXPECT_THAT(text, HasSubstr("has edits only, not where they put anchors: pangea-session replay " +
                              log + " --out DIR"));
  EXPECT_THAT(text, HasSubstr("kettle"));
  EXPECT_THROW(ExportGltf(log, logged, Path("out.gltf")), std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(Path("out.gltf")));
}

TEST_F(LogAnchorsTest, ALogWithoutAnchorsSaysSo) {
  const LoggedAnchors logged = ReadAnchors(kSample);
  EXPECT_EQ(ToText(logged, "sample.lcm"), "sample.lcm: no anchors\n");
  EXPECT_THROW(ToGltf(logged, {}), std::runtime_error);
}

// Edits that the key does not allow, and invalid messages, are counted and change nothing.
TEST_F(LogAnchorsTest, RefusedEditsAreCounted) {
  const std::string path = Path("refused.lcm");
  {
    LogFileWriter log(path);
    AnchorEdit edit = EditOf(kKettle, "kettle", 0);
    edit.right = AnchorRight::kRead;
    Write(log, "ANCHOR_EDIT", edit);
    log.Write(++utime_, "ANCHOR", std::vector<uint8_t>(40, 0xff));
  }
  const LoggedAnchors logged = ReadAnchors(path);
  EXPECT_EQ(logged.num_refused, 2);
  EXPECT_TRUE(logged.anchors.empty());
  EXPECT_THAT(ToText(logged, path), HasSubstr("2 messages refused"));
}

// The server keeps such an edit in its journal, but its anchor does not exist.
TEST_F(LogAnchorsTest, AnEditBeyondTheServersLimitMakesNoAnchor) {
  const std::string path = Path("limit.lcm");
  {
    LogFileWriter log(path);
    options_t options{};
    options.process = "anchors";
    options.yaml = "max_anchors: 1\n";
    log.Write(++utime_, "OPTIONS_anchors", EncodeMessage(options));
    Write(log, "ANCHOR_EDIT", EditOf(kKettle, "kettle", 0));
    Write(log, "ANCHOR_EDIT", EditOf(kDoor, "door", 1));
  }
  const LoggedAnchors logged = ReadAnchors(path);
  EXPECT_EQ(logged.num_refused, 1);
  EXPECT_TRUE(logged.anchors.size() == 1 && logged.anchors.contains(kKettle));
}

TEST_F(LogAnchorsTest, JsonHasEveryField) {
  const json root = json::parse(ToJson(ReadAnchors(Session())));
  ASSERT_EQ(root["anchors"].size(), 3U);
  const json& door = root["anchors"][0];
  EXPECT_EQ(door["id"], "0/20");
  EXPECT_EQ(door["state"], "edited");
  EXPECT_FALSE(door.contains("T_map_anchor"));
  EXPECT_EQ(door["edit"]["placement"], "keyframe");
  EXPECT_EQ(door["edit"]["keyframe_seq"], 3);
  const json& kettle = root["anchors"][1];
  EXPECT_EQ(kettle["payload"], kPayload);
  EXPECT_EQ(kettle["T_map_anchor"]["t_m"], json({1.0, 2.0, 3.0}));
  EXPECT_NEAR(kettle["T_map_anchor"]["q_wxyz"][3].get<double>(), std::sin(0.25), 1e-12);
  EXPECT_EQ(kettle["covariance"].size(), 36U);
  EXPECT_EQ(kettle["map"], ToString(kMap));
  EXPECT_EQ(kettle["group_revision"], 7);
}

// --- glTF

std::vector<uint8_t> BufferOf(const json& root) {
  const std::string prefix = "data:application/octet-stream;base64,";
  const std::string uri = root["buffers"][0]["uri"];
  EXPECT_TRUE(uri.starts_with(prefix));
  std::vector<uint8_t> bytes(uri.size());
  size_t size = 0;
  EXPECT_EQ(sodium_base642bin(bytes.data(), bytes.size(), uri.data() + prefix.size(),
                              uri.size() - prefix.size(), nullptr, &size, nullptr,
                              sodium_base64_VARIANT_ORIGINAL),
            0);
  bytes.resize(size);
  return bytes;
}

// Every index is valid, every view is inside the buffer, every accessor inside its view, and
// positions are inside their stated bounds.
void ExpectWellFormed(const json& root) {
  EXPECT_EQ(root["asset"]["version"], "2.0");
  ASSERT_EQ(root["buffers"].size(), 1U);
  const std::vector<uint8_t> buffer = BufferOf(root);
  EXPECT_EQ(root["buffers"][0]["byteLength"], buffer.size());
  for (const json& view : root["bufferViews"]) {
    EXPECT_EQ(view["buffer"], 0);
    EXPECT_EQ(view["byteOffset"].get<size_t>() % 4, 0U);
    EXPECT_LE(view["byteOffset"].get<size_t>() + view["byteLength"].get<size_t>(), buffer.size());
  }
  for (const json& accessor : root["accessors"]) {
    const bool is_float = accessor["componentType"] == 5126;
    ASSERT_TRUE(is_float || accessor["componentType"] == 5121);
    const size_t item = is_float ? 12 : 4;
    EXPECT_EQ(accessor["type"], is_float ? "VEC3" : "VEC4");
    const json& view = root["bufferViews"].at(accessor["bufferView"].get<size_t>());
    EXPECT_GE(accessor["count"], 1);
    EXPECT_EQ(accessor["count"].get<size_t>() * item, view["byteLength"].get<size_t>());
    if (is_float) {
      std::vector<Eigen::Vector3f> points(accessor["count"].get<size_t>());
      std::memcpy(points.data(), buffer.data() + view["byteOffset"].get<size_t>(),
                  view["byteLength"].get<size_t>());
      for (size_t axis = 0; axis < 3; ++axis) {
        const auto of_axis = [axis](const Eigen::Vector3f& p) {
          return p[static_cast<Eigen::Index>(axis)];
        };
        EXPECT_EQ(accessor["min"][axis].get<float>(),
                  of_axis(*std::ranges::min_element(points, {}, of_axis)));
        EXPECT_EQ(accessor["max"][axis].get<float>(),
                  of_axis(*std::ranges::max_element(points, {}, of_axis)));
      }
    } else {
      EXPECT_EQ(accessor["normalized"], true);
    }
  }
  for (const json& mesh : root["meshes"]) {
    for (const json& primitive : mesh["primitives"]) {
      EXPECT_EQ(primitive["mode"], 0);
      EXPECT_EQ(root["accessors"].at(primitive["attributes"]["POSITION"].get<size_t>())["count"],
                root["accessors"].at(primitive["attributes"]["COLOR_0"].get<size_t>())["count"]);
    }
  }
  std::vector<int> parents(root["nodes"].size());
  for (const json& node : root["nodes"]) {
    EXPECT_FALSE(node.contains("mesh") && node["mesh"].get<size_t>() >= root["meshes"].size());
    for (const json& child : node.value("children", json::array())) {
      ++parents.at(child.get<size_t>());
    }
  }
  EXPECT_LT(root["scene"].get<size_t>(), root["scenes"].size());
  for (const json& scene : root["scenes"]) {
    for (const json& node : scene["nodes"]) {
      EXPECT_EQ(parents.at(node.get<size_t>())++, 0) << "a scene's nodes are roots";
    }
  }
  EXPECT_THAT(parents, testing::Each(1));
}

const json& NodeNamed(const json& root, const std::string& name) {
  for (const json& node : root["nodes"]) {
    if (node["name"] == name) {
      return node;
    }
  }
  throw std::runtime_error("no node " + name);
}

TEST_F(LogAnchorsTest, TheGltfHasThePointsOfThePlyAndTheAnchors) {
  const std::string log = Session();
  ExportGltf(log, ReadAnchors(log), Path("map.gltf"));
  const json root = json::parse(ReadTextFile(Path("map.gltf")));
  ExpectWellFormed(root);
  ExportPly(log, Path("map.ply"));
  const size_t count = root["accessors"][0]["count"];
  EXPECT_GT(count, 1000U);
  EXPECT_THAT(ReadTextFile(Path("map.ply")),
              HasSubstr("element vertex " + std::to_string(count) + "\n"));
  EXPECT_THAT(root["scenes"], SizeIs(1));

  const json& kettle = NodeNamed(root, "kettle");
  EXPECT_EQ(kettle["translation"], json({1.0, 3.0, -2.0}));
  EXPECT_EQ(kettle["extras"]["payload"]["model"], "kettle.glb");
  EXPECT_EQ(kettle["extras"]["anchor"], "1/10");
  EXPECT_THROW(NodeNamed(root, "old"), std::runtime_error);
  EXPECT_THROW(NodeNamed(root, "door"), std::runtime_error);
}

// A point on the anchor has the same position through our frames and through glTF's.
TEST_F(LogAnchorsTest, ItsAxesAreYUp) {
  LoggedAnchors logged;
  AnchorState state = StateOf(kKettle, "kettle", {1, 2, 3});
  state.T_odom_anchor.q = ExpSo3({0.3, -0.7, 1.1});
  logged.anchors[kKettle] = {1, 1, false, "kettle", "no JSON \xff", state, std::nullopt};
  const json root = json::parse(ToGltf(logged, {{kMap, {{{1, 2, 3}, {10, 20, 30}}}}}));
  ExpectWellFormed(root);
  EXPECT_EQ(root["accessors"][0]["min"], json({1.0, 3.0, -2.0}));
  const std::vector<uint8_t> buffer = BufferOf(root);
  EXPECT_EQ(std::vector<uint8_t>(buffer.end() - 4, buffer.end()),
            (std::vector<uint8_t>{10, 20, 30, 255}));

  const json& node = NodeNamed(root, "kettle");
  EXPECT_EQ(node["extras"]["payload"], "no JSON \xEF\xBF\xBD");
  const std::vector<double> q = node["rotation"], t = node["translation"];
  const auto y_up = [](const Eigen::Vector3d& v) { return Eigen::Vector3d(v.x(), v.z(), -v.y()); };
  const Eigen::Vector3d p_anchor(0.4, -0.5, 0.6);
  const Eigen::Vector3d p_gltf = Eigen::Quaterniond(q[3], q[0], q[1], q[2]) * y_up(p_anchor) +
                                 Eigen::Vector3d(t[0], t[1], t[2]);
  EXPECT_LT((p_gltf - y_up(state.T_odom_anchor * p_anchor)).norm(), 1e-12);
}

// Two groups are two frames, so two scenes; an anchor of a frame without points has one too.
TEST_F(LogAnchorsTest, EachGroupIsASceneOfItsOwn) {
  LoggedAnchors logged;
  AnchorState state = StateOf(kKettle, "kettle", {1, 2, 3});
  state.map = state.group = {9, 9};
  logged.anchors[kKettle] = {1, 1, false, "kettle", "", state, std::nullopt};
  const std::vector<ColouredPoint> points = {{{1, 2, 3}, {}}, {{-1, 5, 0}, {}}};
  const json root = json::parse(ToGltf(logged, {{kMap, points}, {{7, 7}, {}}, {{8, 8}, points}}));
  ExpectWellFormed(root);
  ASSERT_THAT(root["scenes"], SizeIs(3));
  EXPECT_EQ(root["scenes"][0]["name"], "map " + ToString(kMap));
  EXPECT_EQ(root["scenes"][2]["name"], "map 9/9");
}

}  // namespace
}  // namespace pangea
