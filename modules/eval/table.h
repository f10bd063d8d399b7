#pragma once

// A table for people, as HTML, and as Markdown with padded columns, readable as plain text too.

#include <string>
#include <vector>

namespace pangea {

class Table {
 public:
  explicit Table(std::vector<std::string> header) : rows_{std::move(header)} {}
  // Requires as many cells as the header has.
  void Add(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
  // Whether there is only the header.
  bool empty() const { return rows_.size() == 1; }
  std::string Text() const;
  // Cells that are numbers have the class "n".
  std::string Html() const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

// Escapes a text for use between tags and in quoted attributes. Bytes that are invalid in UTF-8 or
// in XML become a replacement character.
std::string EscapeHtml(const std::string& text);

}  // namespace pangea
