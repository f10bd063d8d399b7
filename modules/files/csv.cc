#include "files/csv.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "files/text_file.h"

namespace pangea {
namespace {

std::string_view Trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const size_t begin = text.find_first_not_of(kBlank);
  if (begin == std::string_view::npos) {
    return {};
  }
  return text.substr(begin, text.find_last_not_of(kBlank) - begin + 1);
}

// Spreadsheets and some writers put texts into quotes.
std::string_view WithoutQuotes(std::string_view field) {
  const bool is_quoted = field.size() >= 2 && field.front() == field.back() &&
                         (field.front() == '"' || field.front() == '\'');
  return is_quoted ? Trimmed(field.substr(1, field.size() - 2)) : field;
}

std::vector<std::string> SplitAtCommas(std::string_view line) {
  std::vector<std::string> fields;
  for (size_t begin = 0; begin <= line.size();) {
    const size_t end = std::min(line.find(',', begin), line.size());
    fields.emplace_back(WithoutQuotes(Trimmed(line.substr(begin, end - begin))));
    begin = end + 1;
  }
  return fields;
}

std::vector<std::string> SplitAtBlanks(std::string_view line) {
  std::vector<std::string> fields;
  for (size_t begin = line.find_first_not_of(" \t"); begin != std::string_view::npos;) {
    const size_t end = std::min(line.find_first_of(" \t", begin), line.size());
    fields.emplace_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(" \t", end);
  }
  return fields;
}

template <typename T>
bool ParseWhole(std::string_view field, T* value) {
  const char* end = field.data() + field.size();
  const auto [stop, error] = std::from_chars(field.data(), end, *value);
  return error == std::errc() && stop == end;
}

}  // namespace

std::vector<CsvRow> ReadCsv(const std::string& path) {
  std::ifstream file = OpenFile(path);
  std::vector<CsvRow> rows;
  std::string text;
  for (int line = 1; std::getline(file, text); ++line) {
    const bool line_ended = !file.eof();
    const bool is_marked = line == 1 && text.starts_with("\xEF\xBB\xBF");
    const std::string_view content = Trimmed(std::string_view(text).substr(is_marked ? 3 : 0));
    if (content.empty() || content.front() == '#') {
      continue;
    }
    const bool has_commas = content.find(',') != std::string_view::npos;
    CsvRow row{line, has_commas ? SplitAtCommas(content) : SplitAtBlanks(content), has_commas,
               line_ended};
    double number = 0;
    const bool is_header = rows.empty() && line == 1 && !ParseNumber(row.fields.front(), &number);
    if (!is_header) {
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

bool ParseNumber(std::string_view field, double* value) {
  return ParseWhole(field, value) && std::isfinite(*value);
}

bool ParseNumber(std::string_view field, int64_t* value) { return ParseWhole(field, value); }

bool IsNotFinite(const std::string& field) {
  char* end = nullptr;
  const double value = std::strtod(field.c_str(), &end);
  return end != field.c_str() && *end == '\0' && !std::isfinite(value);
}

void RowComplaints::Add(int line, const std::string& what) {
  if (++count_ <= kKept) {
    kept_.push_back(fmt::format("{}:{}: {}", path_, line, what));
  }
}

std::vector<std::string> RowComplaints::Lines() const {
  std::vector<std::string> lines = kept_;
  if (count_ > kKept) {
    lines.push_back(fmt::format("{}: ... and {} more such rows", path_, count_ - kKept));
  }
  return lines;
}

void RowComplaints::ThrowIfTooMany(size_t num_rows, const std::string& expected) const {
  if (count_ > 1 && static_cast<size_t>(count_) > num_rows / 10) {
    throw std::runtime_error(fmt::format("{} (and {} more of {} rows); expected: {}", kept_.front(),
                                         count_ - 1, num_rows, expected));
  }
}

}  // namespace pangea
