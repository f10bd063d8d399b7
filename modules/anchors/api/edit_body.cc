#include "anchors/api/edit_body.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>
#include <vector>

#include "core/text/control_characters.h"
#include "options/nearest_word.h"

namespace pangea {
namespace {

using nlohmann::json;

constexpr int64_t kMaxUtime = 1LL << 60;
constexpr int64_t kMaxRevision = 1LL << 60;
constexpr int64_t kMaxAgent = 65535;
constexpr int64_t kMaxSeq = 10'000'000;
constexpr double kMaxDistance_m = 1e5;
constexpr double kMaxPixel = 1e5;
constexpr double kNormTolerance = 1e-3;

// Reads the fields of a JSON object by name; throws BadField for an error.
class Fields {
 public:
  Fields(const json& object, std::string path, std::initializer_list<std::string> known)
      : object_(object), path_(std::move(path)) {
    if (!object.is_object()) {
      throw BadField{path_, "give an object, {...}"};
    }
    const std::vector<std::string> names(known);
    for (const auto& [key, value] : object.items()) {
      if (std::ranges::find(names, key) == names.end()) {
        throw BadField{Path(key), "there is no such field" + NearestWordHint(key, names)};
      }
    }
  }

  bool Has(const std::string& key) const { return object_.contains(key); }
  std::string Path(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }

  const json& Need(const std::string& key) const {
    if (!Has(key)) {
      throw BadField{Path(key), "is missing"};
    }
    return object_[key];
  }
  int64_t Integer(const std::string& key, int64_t min, int64_t max) const {
    const json& value = Need(key);
    if (!value.is_number_integer() ||
        (value.is_number_unsigned() && value.get<uint64_t>() > static_cast<uint64_t>(max)) ||
        value.get<int64_t>() < min || value.get<int64_t>() > max) {
      throw BadField{Path(key), fmt::format("give a whole number, {} to {}", min, max)};
    }
    return value.get<int64_t>();
  }
  std::string Text(const std::string& key, size_t max_bytes) const {
    const json& value = Need(key);
    if (!value.is_string() || value.get_ref<const std::string&>().size() > max_bytes) {
      throw BadField{Path(key), fmt::format("give a text of at most {} bytes", max_bytes)};
    }
    return value.get<std::string>();
  }
  template <int N>
  Eigen::Matrix<double, N, 1> Numbers(const std::string& key, double limit,
                                      const char* mend) const {
    const json& value = Need(key);
    Eigen::Matrix<double, N, 1> numbers;
    const bool fits =
        value.is_array() && value.size() == N && std::ranges::all_of(value, [&](const json& item) {
          return item.is_number() && std::abs(item.get<double>()) <= limit;
        });
    if (!fits) {
      throw BadField{Path(key), mend};
    }
    for (int i = 0; i < N; ++i) {
      numbers[i] = value[static_cast<size_t>(i)].get<double>();
    }
    return numbers;
  }
  MapId Map(const std::string& key) const {
    const json& value = Need(key);
    const auto map = value.is_string() ? ParseMapId(value.get_ref<const std::string&>())
                                       : std::optional<MapId>();
    if (!map) {
      throw BadField{Path(key), "give a map's id as a text, \"AGENT/OPENED_UTIME\""};
    }
    return *map;
  }

 private:
  const json& object_;
  const std::string path_;
};

Rigid3 ParseTransform(const Fields& fields) {
  Rigid3 T;
  T.t = fields.Numbers<3>("position", kMaxDistance_m, "give [x, y, z], metres, 100 km at most");
  if (fields.Has("orientation")) {
    const char* const mend = "give [w, x, y, z], a quaternion of norm 1";
    const Eigen::Vector4d wxyz = fields.Numbers<4>("orientation", 2, mend);
    if (std::abs(wxyz.norm() - 1) > kNormTolerance) {
      throw BadField{fields.Path("orientation"), mend};
    }
    T.q = Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized();
  }
  return T;
}

// The field that names the frame decides which of the three alternatives it is.
BodyPose ParsePose(const json& pose) {
  if (pose.is_object() && pose.contains("group")) {
    const Fields fields(pose, "pose", {"group", "position", "orientation"});
    return PoseInGroup{fields.Map("group"), ParseTransform(fields)};
  }
  if (pose.is_object() && pose.contains("keyframe")) {
    const Fields fields(pose, "pose", {"keyframe", "position", "orientation"});
    const Fields keyframe(fields.Need("keyframe"), "pose.keyframe", {"map", "seq"});
    return PoseByKeyframe{
        {keyframe.Map("map"), static_cast<int32_t>(keyframe.Integer("seq", 0, kMaxSeq))},
        ParseTransform(fields)};
  }
  if (pose.is_object() && pose.contains("agent")) {
    const Fields fields(pose, "pose", {"agent", "utime", "pixel"});
    return PoseBehindPixel{
        static_cast<int32_t>(fields.Integer("agent", 1, kMaxAgent)),
        fields.Integer("utime", 0, kMaxUtime),
        fields.Numbers<2>("pixel", kMaxPixel, "give [u, v], pixels of the raw image")};
  }
  throw BadField{"pose",
                 "give {group, position, orientation}, {keyframe: {map, seq}, position, "
                 "orientation} or {agent, utime, pixel}"};
}

EditBody ParseFields(const json& body, BodyOf of) {
  const Fields fields = of == BodyOf::kNew
                            ? Fields(body, "", {"name", "payload", "pose"})
                            : Fields(body, "", {"name", "payload", "pose", "revision"});
  EditBody edit;
  if (fields.Has("name")) {
    edit.name = fields.Text("name", kMaxAnchorName);
    if (edit.name->empty()) {
      throw BadField{"name", fmt::format("is empty: give 1 to {} bytes", kMaxAnchorName)};
    }
    // LCM's strings end at a zero, and a name is for people.
    if (HasControlCharacter(*edit.name)) {
      throw BadField{"name", "has control characters: give one line of text"};
    }
  }
  if (fields.Has("payload")) {
    edit.payload = fields.Text("payload", kMaxAnchorPayload);
    if (edit.payload->find('\0') != std::string::npos) {
      throw BadField{"payload", "has a zero byte: give a text, JSON for example"};
    }
  }
  if (fields.Has("revision")) {
    edit.revision = fields.Integer("revision", 1, kMaxRevision);
  }
  if (of == BodyOf::kNew || fields.Has("pose")) {
    edit.pose = ParsePose(fields.Need("pose"));
  }
  if (of == BodyOf::kNew) {
    fields.Need("name");
  }
  if (of == BodyOf::kChange && !edit.name && !edit.payload && !edit.pose) {
    throw BadField{"", "there is nothing to change: give name, payload or pose"};
  }
  return edit;
}

// `twice`: a field that occurs twice in an object; the parser uses the last one.
json ParseNotingTwice(std::string_view text, std::optional<std::string>* twice) {
  std::vector<std::set<std::string>> seen;  // one per open object
  const auto note = [&](int, json::parse_event_t event, const json& parsed) {
    if (event == json::parse_event_t::object_start) {
      seen.emplace_back();
    } else if (event == json::parse_event_t::object_end) {
      seen.pop_back();
    } else if (event == json::parse_event_t::key && !seen.back().insert(parsed).second) {
      *twice = parsed;
    }
    return true;
  };
  return json::parse(text, note, false);
}

}  // namespace

std::variant<EditBody, BadField> ParseEditBody(std::string_view text, BodyOf of) {
  std::optional<std::string> twice;
  const json body = ParseNotingTwice(text, &twice);
  if (body.is_discarded()) {
    return BadField{"", "the body is not JSON in UTF-8"};
  }
  if (twice) {
    return BadField{*twice, "is given twice: give it once"};
  }
  try {
    return ParseFields(body, of);
  } catch (const BadField& bad) {
    return bad;
  }
}

std::optional<int64_t> ParseNumber(std::string_view text, int64_t max) {
  int64_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  const bool fits = error == std::errc() && stop == end && text.front() != '-' && number <= max;
  return fits ? std::optional(number) : std::nullopt;
}

std::optional<MapId> ParseMapId(std::string_view text) {
  const size_t slash = text.find('/');
  if (slash == std::string_view::npos) {
    return std::nullopt;
  }
  const auto agent = ParseNumber(text.substr(0, slash), kMaxAgent);
  const auto opened = ParseNumber(text.substr(slash + 1), kMaxUtime);
  return agent && *agent > 0 && opened ? std::optional(MapId{static_cast<int32_t>(*agent), *opened})
                                       : std::nullopt;
}

std::optional<AnchorId> ParseAnchorId(std::string_view agent, std::string_view created) {
  const auto agent_id = ParseNumber(agent, kMaxAgent);
  const auto created_utime = ParseNumber(created, kMaxUtime);
  return agent_id && created_utime
             ? std::optional(AnchorId{static_cast<int32_t>(*agent_id), *created_utime})
             : std::nullopt;
}

}  // namespace pangea
