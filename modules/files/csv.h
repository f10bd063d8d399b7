#pragma once

// Reads rows of numbers from text files (EuRoC csv, TUM). Strict: each complaint names file and
// line.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace pangea {

struct CsvRow {
  int line = 0;                     // from 1
  std::vector<std::string> fields;  // trimmed
  bool has_commas = false;          // between its fields; else blanks
  bool line_ended = true;           // false: the file ends without a newline after this row
};

// Splits each line at commas or, if it has none, at blanks. Fields between commas may be in quotes.
// Skips empty lines, those that begin with '#', a header (line 1, if its first field is not a
// number), and the byte order mark that editors write at the beginning. Throws as OpenFile
// (text_file.h).
std::vector<CsvRow> ReadCsv(const std::string& path);

// Converts a whole field. False if something is left over, on overflow, and for NaN or infinity.
bool ParseNumber(std::string_view field, double* value);
bool ParseNumber(std::string_view field, int64_t* value);
// Whether the field is a number that is not finite: "nan", "-inf" or "1e400".
bool IsNotFinite(const std::string& field);

// Collects the malformed rows of one file: the first few with their text, then only a count.
class RowComplaints {
 public:
  explicit RowComplaints(std::string path) : path_(std::move(path)) {}
  void Add(int line, const std::string& what);
  int count() const { return count_; }
  // One line of text per kept complaint, and "... and n more".
  std::vector<std::string> Lines() const;
  // Throws std::runtime_error when more than one row and more than a tenth of all rows are
  // malformed. The file then probably has another format, which dropping rows would hide.
  // `expected` names the right format.
  void ThrowIfTooMany(size_t num_rows, const std::string& expected) const;

 private:
  static constexpr int kKept = 5;
  std::string path_;
  std::vector<std::string> kept_;
  int count_ = 0;
};

}  // namespace pangea
