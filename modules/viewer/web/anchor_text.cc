#include "viewer/web/anchor_text.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/text/control_characters.h"

namespace pangea::viewer {
namespace {

using nlohmann::json;

constexpr uint64_t kMaxAgent = 65535;
constexpr uint64_t kMaxUtime = 1ULL << 53;  // JavaScript has no larger exact integers

bool IsNumberBelow(const json& value, uint64_t end) {
  return value.is_number_unsigned() && value.get<uint64_t>() < end;
}

// A name must be printable, as in messages, and not empty.
bool TakeName(const json& value, AnchorChange* change) {
  if (!value.is_string()) {
    return false;
  }
  change->name = value.get<std::string>();
  return !change->name.empty() && change->name.size() <= kMaxAnchorName &&
         !HasControlCharacter(change->name);
}

bool TakeId(const json& value, AnchorChange* change) {
  if (!value.is_array() || value.size() != 2 || !IsNumberBelow(value[0], kMaxAgent + 1) ||
      !IsNumberBelow(value[1], kMaxUtime)) {
    return false;
  }
  change->anchor = AnchorId{value[0].get<int32_t>(), value[1].get<int64_t>()};
  return true;
}

bool TakeKeyframe(const json& value, AnchorChange* change) {
  if (!IsNumberBelow(value, Scene::kMaxKeyframes)) {
    return false;
  }
  change->keyframe = value.get<int64_t>();
  return true;
}

bool TakePoint(const json& value, AnchorChange* change) {
  if (!value.is_array() || value.size() != 3) {
    return false;
  }
  for (size_t i = 0; i < 3; ++i) {
    if (!value[i].is_number() || !(std::abs(value[i].get<double>()) <= kMaxAnchorDistance_m)) {
      return false;
    }
    change->p_body[static_cast<Eigen::Index>(i)] = value[i].get<double>();
  }
  return true;
}

bool TakeField(const std::string& field, const json& value, AnchorChange* change) {
  if (field == "name") {
    return TakeName(value, change);
  }
  if (field == "anchor") {
    return TakeId(value, change);
  }
  if (field == "keyframe") {
    return TakeKeyframe(value, change);
  }
  return field == "p_body" && TakePoint(value, change);
}

std::vector<std::string> FieldsOf(const std::string& key) {
  if (key == "anchor_add") {
    return {"name", "keyframe", "p_body"};
  }
  if (key == "anchor_move") {
    return {"anchor", "keyframe", "p_body"};
  }
  return key == "anchor_delete" ? std::vector<std::string>{"anchor"} : std::vector<std::string>{};
}

}  // namespace

std::optional<AnchorChange> ParseAnchorChange(const std::string& key, const json& value) {
  const std::vector<std::string> fields = FieldsOf(key);
  if (fields.empty() || !value.is_object() || value.size() != fields.size()) {
    return std::nullopt;
  }
  AnchorChange change;
  change.deleted = key == "anchor_delete";
  for (const std::string& field : fields) {
    if (!value.contains(field) || !TakeField(field, value[field], &change)) {
      return std::nullopt;
    }
  }
  return change;
}

}  // namespace pangea::viewer
