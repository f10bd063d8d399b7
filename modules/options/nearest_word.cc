#include "options/nearest_word.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace pangea {
namespace {

// Levenshtein distance.
size_t EditDistance(const std::string& a, const std::string& b) {
  std::vector<size_t> row(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) {
    row[j] = j;
  }
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row.back();
}

}  // namespace

std::optional<std::string> NearestWord(const std::string& word,
                                       const std::vector<std::string>& known) {
  const auto nearest = std::min_element(known.begin(), known.end(),
                                        [&word](const std::string& a, const std::string& b) {
                                          return EditDistance(a, word) < EditDistance(b, word);
                                        });
  // Two edits, or edits of half the word's length if that is more, still count as near.
  const bool is_near = nearest != known.end() &&
                       EditDistance(*nearest, word) <= std::max<size_t>(2, word.size() / 2);
  return is_near ? std::optional(*nearest) : std::nullopt;
}

std::string NearestWordHint(const std::string& word, const std::vector<std::string>& known,
                            const std::string& prefix) {
  if (known.empty()) {
    return "; none is known here";
  }
  const auto nearest = NearestWord(word, known);
  return nearest ? fmt::format("; did you mean '{}{}'?", prefix, *nearest)
                 : fmt::format("; known are {}", fmt::join(known, ", "));
}

}  // namespace pangea
