#include "eval/table.h"

#include <fmt/format.h>

#include <algorithm>

namespace pangea {

std::string Table::Text() const {
  std::vector<size_t> widths(rows_.front().size(), 3);
  for (const auto& row : rows_) {
    for (size_t i = 0; i < row.size(); ++i) {
      widths[i] = std::max(widths[i], row[i].size());
    }
  }
  std::string text;
  for (size_t r = 0; r < rows_.size(); ++r) {
    for (size_t i = 0; i < widths.size(); ++i) {
      text += fmt::format("| {:<{}} ", rows_[r][i], widths[i]);
    }
    text += "|\n";
    for (size_t i = 0; r == 0 && i < widths.size(); ++i) {
      text += fmt::format("|{:-<{}}", "", widths[i] + 2);
    }
    text += r == 0 ? "|\n" : "";
  }
  return text;
}

}  // namespace pangea
