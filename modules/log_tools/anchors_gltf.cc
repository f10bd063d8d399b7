#include "log_tools/anchors_gltf.h"

#include <fmt/format.h>
#include <sodium.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "files/text_file.h"

namespace pangea {
namespace {

using nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little);  // like glTF's buffers

// Constants of glTF.
constexpr int kFloat = 5126, kUnsignedByte = 5121, kArrayBuffer = 34962, kPoints = 0;

Eigen::Vector3d YUp(const Eigen::Vector3d& v) { return {v.x(), v.z(), -v.y()}; }

// The anchor's own axes become y-up too.
Eigen::Quaterniond YUp(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.z(), -q.y()}; }

std::string Base64(const std::vector<uint8_t>& bytes) {
  std::string text(sodium_base64_encoded_len(bytes.size(), sodium_base64_VARIANT_ORIGINAL), '\0');
  sodium_bin2base64(text.data(), text.size(), bytes.data(), bytes.size(),
                    sodium_base64_VARIANT_ORIGINAL);
  text.pop_back();  // its terminating zero
  return text;
}

class GltfWriter {
 public:
  GltfWriter() {
    json_["asset"] = {
        {"version", "2.0"},
        {"generator", "pangea-log anchors"},
        {"extras", {{"axes", "metres, y up: (x, y, z) of the map frame (z up) is (x, z, -y)"}}}};
    json_["scene"] = 0;
  }

  void AddGroup(const GltfGroup& group, const LoggedAnchors& logged) {
    ordered_json children = ordered_json::array();
    if (!group.points.empty()) {
      children.push_back(AddNode({{"name", "points"}, {"mesh", AddMesh(group.points)}}));
    }
    for (const auto& [id, anchor] : logged.anchors) {
      if (anchor.state && !anchor.deleted && anchor.state->map == group.frame) {
        children.push_back(AddNode(NodeOf(id, anchor)));
      }
    }
    if (!children.empty()) {
      const std::string name = "map " + ToString(group.frame);
      const size_t root = AddNode({{"name", name}, {"children", std::move(children)}});
      json_["scenes"].push_back({{"name", name}, {"nodes", ordered_json::array({root})}});
    }
  }

  bool empty() const { return !json_.contains("scenes"); }

  std::string Finish() {
    if (!buffer_.empty()) {
      json_["buffers"].push_back(
          {{"byteLength", buffer_.size()},
           {"uri", "data:application/octet-stream;base64," + Base64(buffer_)}});
    }
    // A name or a payload may be invalid UTF-8.
    return json_.dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
  }

 private:
  size_t Append(const char* list, ordered_json item) {
    json_[list].push_back(std::move(item));
    return json_[list].size() - 1;
  }
  size_t AddNode(ordered_json node) { return Append("nodes", std::move(node)); }

  static ordered_json NodeOf(const AnchorId& id, const LoggedAnchor& anchor) {
    const Eigen::Vector3d t = YUp(anchor.state->T_odom_anchor.t);
    const Eigen::Quaterniond q = YUp(anchor.state->T_odom_anchor.q);
    ordered_json payload = ordered_json::parse(anchor.payload, nullptr, false);
    if (payload.is_discarded()) {
      payload = anchor.payload;
    }
    return {{"name", anchor.name},
            {"translation", {t.x(), t.y(), t.z()}},
            {"rotation", {q.x(), q.y(), q.z(), q.w()}},
            {"extras",
             {{"anchor", ToString(id)},
              {"revision", anchor.revision},
              {"payload", std::move(payload)},
              {"sigma_m", RmsPositionSigma(*anchor.state)}}}};
  }

  // Appends to the buffer; returns the index of the accessor.
  size_t AddAccessor(const void* data, size_t bytes, ordered_json accessor) {
    const size_t offset = buffer_.size();
    buffer_.resize(offset + bytes);
    std::memcpy(buffer_.data() + offset, data, bytes);
    accessor["bufferView"] = Append(
        "bufferViews",
        {{"buffer", 0}, {"byteOffset", offset}, {"byteLength", bytes}, {"target", kArrayBuffer}});
    return Append("accessors", std::move(accessor));
  }

  size_t AddMesh(const std::vector<ColouredPoint>& points) {
    std::vector<Eigen::Vector3f> positions;
    std::vector<uint8_t> colours;  // four bytes per point: attributes must be aligned to four bytes
    for (const ColouredPoint& point : points) {
      positions.push_back(YUp(point.p_map).cast<float>());
      colours.insert(colours.end(), {point.rgb[0], point.rgb[1], point.rgb[2], 255});
    }
    Eigen::Vector3f least = positions.front(), most = positions.front();
    for (const Eigen::Vector3f& p : positions) {
      least = least.cwiseMin(p);
      most = most.cwiseMax(p);
    }
    const size_t position =
        AddAccessor(positions.data(), positions.size() * sizeof(Eigen::Vector3f),
                    {{"componentType", kFloat},
                     {"count", points.size()},
                     {"type", "VEC3"},
                     {"min", {least.x(), least.y(), least.z()}},
                     {"max", {most.x(), most.y(), most.z()}}});
    const size_t colour = AddAccessor(colours.data(), colours.size(),
                                      {{"componentType", kUnsignedByte},
                                       {"normalized", true},
                                       {"count", points.size()},
                                       {"type", "VEC4"}});
    const ordered_json primitive = {{"attributes", {{"POSITION", position}, {"COLOR_0", colour}}},
                                    {"mode", kPoints}};
    return Append("meshes", {{"name", "points"}, {"primitives", ordered_json::array({primitive})}});
  }

  ordered_json json_;
  std::vector<uint8_t> buffer_;
};

// The given groups, and those that occur only in anchors.
std::vector<GltfGroup> AllGroups(const LoggedAnchors& logged, std::vector<GltfGroup> groups) {
  for (const auto& [id, anchor] : logged.anchors) {
    if (anchor.state && !anchor.deleted &&
        std::ranges::find(groups, anchor.state->map, &GltfGroup::frame) == groups.end()) {
      groups.push_back({anchor.state->map, {}});
    }
  }
  return groups;
}

}  // namespace

std::string ToGltf(const LoggedAnchors& logged, const std::vector<GltfGroup>& groups) {
  GltfWriter writer;
  for (const GltfGroup& group : AllGroups(logged, groups)) {
    writer.AddGroup(group, logged);
  }
  if (writer.empty()) {
    throw std::runtime_error("there is neither a map point nor an anchor to export");
  }
  return writer.Finish();
}

void ExportGltf(const std::string& log, const LoggedAnchors& logged, const std::string& file,
                LogReadings* readings) {
  if (logged.edits_only()) {
    throw std::runtime_error(fmt::format(
        "{}: has edits of anchors only, so there is no map to export: pangea-session replay {} "
        "--out DIR, then the same with DIR/session.lcm",
        log, log));
  }
  const CapturedSession session = ReadServerLog(log, readings);
  const ReportMetrics metrics = ComputeMetrics({.server_log = log}, session);
  std::vector<GltfGroup> groups;
  for (const GroupMetrics& group : metrics.groups) {
    groups.push_back({group.group.frame, MapPoints(session, metrics, group.group)});
  }
  WriteTextFile(file, ToGltf(logged, groups));
}

}  // namespace pangea
