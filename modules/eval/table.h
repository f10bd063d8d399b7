#pragma once

// A table for people: in Markdown, with columns padded so that it reads well as plain text too.

#include <string>
#include <vector>

namespace pangea {

class Table {
 public:
  explicit Table(std::vector<std::string> header) : rows_{std::move(header)} {}
  // As many cells as the header has.
  void Add(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
  std::string Text() const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace pangea
