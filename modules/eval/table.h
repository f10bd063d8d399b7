#pragma once

// A table for people: in Markdown, with columns padded so that it reads well as plain text too, and
// in HTML.

#include <string>
#include <vector>

namespace pangea {

class Table {
 public:
  explicit Table(std::vector<std::string> header) : rows_{std::move(header)} {}
  // As many cells as the header has.
  void Add(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
  // Nothing but the header.
  bool empty() const { return rows_.size() == 1; }
  std::string Text() const;
  // Cells that are numbers have the class "n".
  std::string Html() const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

// Text as it is, between tags and in quoted attributes; of bytes that are no UTF-8 or that XML does
// not know, a replacement character.
std::string EscapeHtml(const std::string& text);

}  // namespace pangea
