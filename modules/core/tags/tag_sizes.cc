#include "core/tags/tag_sizes.h"

#include <fmt/format.h>

#include <charconv>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace pangea {
namespace {

std::string_view Trimmed(std::string_view text) {
  const size_t first = text.find_first_not_of(' ');
  return first == std::string_view::npos
             ? ""
             : text.substr(first, text.find_last_not_of(' ') - first + 1);
}

std::optional<int> NumberIn(std::string_view text) {
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() && number >= 0
             ? std::optional(number)
             : std::nullopt;
}

// The first and last id of "7" or "0-99"; nothing if it is neither.
std::optional<std::pair<int, int>> RangeIn(std::string_view text) {
  const size_t dash = text.find('-');
  const auto first = NumberIn(Trimmed(text.substr(0, dash)));
  const auto last =
      dash == std::string_view::npos ? first : NumberIn(Trimmed(text.substr(dash + 1)));
  return first && last && *first <= *last ? std::optional(std::pair(*first, *last)) : std::nullopt;
}

std::vector<int> IdsIn(const std::string& ids, TagFamily family, const std::string& field) {
  std::vector<int> found;
  for (std::string_view rest = ids;; rest = rest.substr(rest.find(',') + 1)) {
    const std::string_view part = Trimmed(rest.substr(0, rest.find(',')));
    const auto range = RangeIn(part);
    if (!range) {
      throw std::runtime_error(
          fmt::format("{}.ids: '{}' is no id; write numbers and ranges, as 0-19, 30", field, part));
    }
    if (range->second >= NumTagIds(family)) {
      throw std::runtime_error(fmt::format("{}.ids: {} is too large: family {} has the ids 0 to {}",
                                           field, range->second, NameOf(family),
                                           NumTagIds(family) - 1));
    }
    for (int id = range->first; id <= range->second; ++id) {
      found.push_back(id);
    }
    if (rest.find(',') == std::string_view::npos) {
      return found;
    }
  }
}

}  // namespace

TagSizes::TagSizes(const std::vector<SizedTags>& tags) {
  for (size_t i = 0; i < tags.size(); ++i) {
    const std::string field = fmt::format("tags[{}]", i);
    constexpr TagFamily kFamily = TagFamily::k36h11;
    if (tags[i].family != NameOf(kFamily)) {
      throw std::runtime_error(fmt::format("{}.family: '{}' is unknown; agents look for {} alone",
                                           field, tags[i].family, NameOf(kFamily)));
    }
    for (const int id : IdsIn(tags[i].ids, kFamily, field)) {
      if (!sizes_.emplace(TagId{kFamily, id}, tags[i].size_m).second) {
        throw std::runtime_error(fmt::format(
            "{}.ids: {} is there twice; print each tag once, and give it one size", field, id));
      }
    }
  }
}

std::optional<double> TagSizes::Of(const TagId& tag) const {
  const auto found = sizes_.find(tag);
  return found == sizes_.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace pangea
