#pragma once

// Rows of numbers from text files (EuRoC csv, TUM): strict, and each complaint names file and line.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace pangea {

struct CsvRow {
  int line = 0;                     // from 1
  std::vector<std::string> fields;  // trimmed
  bool line_ended = true;           // false: the file stops without a newline behind this row
};

// Splits at commas or, when a line has none, at blanks; skips empty lines and those that begin with
// '#' or are a header (first field not a number and no row before it).
// Throws as OpenFile (text_file.h).
std::vector<CsvRow> ReadCsv(const std::string& path);

// Whole-field conversions; false on anything left over, on overflow, and on NaN or infinity.
bool ParseNumber(std::string_view field, double* value);
bool ParseNumber(std::string_view field, int64_t* value);
// "nan", "-inf", "1e400": a number to its writer, and none to reckon with.
bool IsNotFinite(const std::string& field);

// Gathers what was wrong with the rows of one file without flooding: the first few in full, then a
// count.
class RowComplaints {
 public:
  explicit RowComplaints(std::string path) : path_(std::move(path)) {}
  void Add(int line, const std::string& what);
  // One line of text per kept complaint, and "... and n more".
  std::vector<std::string> Lines() const;
  // Throws when more than one row and a tenth of all are malformed: then it is another format, and
  // dropping rows would hide that.
  void ThrowIfTooMany(size_t num_rows, const std::string& expected) const;

 private:
  static constexpr int kKept = 5;
  std::string path_;
  std::vector<std::string> kept_;
  int count_ = 0;
};

}  // namespace pangea
