#include "viewer/web/page_link.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "viewer/web/anchor_text.h"

namespace pangea::viewer {
namespace {

// Bytes of records in one update: a phone can process them within one or two frames.
constexpr size_t kBudget = 300'000;
constexpr uint64_t kMaxWatchedAgent = 100'000;

}  // namespace

std::optional<std::vector<uint8_t>> PageLink::Next() {
  if (under_way_ || !HasUpdate(show_, seen_)) {
    return std::nullopt;
  }
  under_way_ = true;
  return EncodeUpdate(show_, kBudget, &seen_);
}

bool PageLink::Receive(std::string_view text) {
  if (text.size() > kMaxText) {
    return false;
  }
  const auto said = nlohmann::json::parse(text, nullptr, false);
  if (!said.is_object() || said.size() != 1) {
    return false;
  }
  const std::string& key = said.begin().key();
  const auto& value = said.begin().value();
  if (key == "taken" && value.is_number_unsigned()) {
    under_way_ = false;
  } else if (key == "watch" && value.is_number_unsigned() &&
             value.get<uint64_t>() < kMaxWatchedAgent) {
    seen_.watched = value.get<int32_t>();
    seen_.view = 0;
  } else if (key == "play" && value.is_boolean()) {
    show_.Play(value.get<bool>());
  } else if (key == "seek" && value.is_number() && std::isfinite(value.get<double>())) {
    show_.Seek(value.get<double>());
  } else if (key == "speed" && value.is_number() && value.get<double>() > 0 &&
             value.get<double>() <= kMaxSpeed) {
    show_.SetSpeed(value.get<double>());
  } else if (const auto change = ParseAnchorChange(key, value); change && show_.editable()) {
    show_.Change(*change);
  } else {
    return false;
  }
  return true;
}

}  // namespace pangea::viewer
