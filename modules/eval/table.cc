#include "eval/table.h"

#include <fmt/format.h>

#include <algorithm>

namespace pangea {
namespace {

bool IsNumber(const std::string& cell) {
  return !cell.empty() && cell.find_first_not_of("0123456789.,+-% ") == std::string::npos;
}

// Length of the UTF-8 sequence that begins here; 0 if it is invalid.
size_t SequenceAt(const std::string& text, size_t at) {
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  const size_t length = byte(at) < 0x80   ? 1
                        : byte(at) < 0xc2 ? 0
                        : byte(at) < 0xe0 ? 2
                        : byte(at) < 0xf0 ? 3
                        : byte(at) < 0xf5 ? 4
                                          : 0;
  for (size_t i = at + 1; i < at + length; ++i) {
    if (i >= text.size() || (byte(i) & 0xc0) != 0x80) {
      return 0;
    }
  }
  const bool control = length == 1 && byte(at) < 0x20 && text[at] != '\n' && text[at] != '\t';
  return control ? 0 : length;
}

// A bar or the end of a line would end the cell.
std::string Cell(const std::string& text) {
  std::string cell;
  for (const char c : text) {
    cell += c == '|' ? "\\|" : std::string(1, c == '\n' ? ' ' : c);
  }
  return cell;
}

}  // namespace

std::string Table::Text() const {
  std::vector<std::vector<std::string>> rows = rows_;
  std::vector<size_t> widths(rows.front().size(), 3);
  for (auto& row : rows) {
    for (size_t i = 0; i < row.size(); ++i) {
      row[i] = Cell(row[i]);
      widths[i] = std::max(widths[i], row[i].size());
    }
  }
  std::string text;
  for (size_t r = 0; r < rows.size(); ++r) {
    for (size_t i = 0; i < widths.size(); ++i) {
      text += fmt::format("| {:<{}} ", rows[r][i], widths[i]);
    }
    text += "|\n";
    for (size_t i = 0; r == 0 && i < widths.size(); ++i) {
      text += fmt::format("|{:-<{}}", "", widths[i] + 2);
    }
    text += r == 0 ? "|\n" : "";
  }
  return text;
}

std::string Table::Html() const {
  std::string html = "<div class=\"wide\"><table>\n";
  for (size_t r = 0; r < rows_.size(); ++r) {
    html += "<tr>";
    for (const std::string& cell : rows_[r]) {
      const char* const tag = r == 0 ? "th" : "td";
      const char* const number = r > 0 && IsNumber(cell) ? " class=\"n\"" : "";
      html += fmt::format("<{0}{1}>{2}</{0}>", tag, number, EscapeHtml(cell));
    }
    html += "</tr>\n";
  }
  return html + "</table></div>\n";
}

std::string EscapeHtml(const std::string& text) {
  std::string html;
  for (size_t i = 0; i < text.size();) {
    const size_t length = SequenceAt(text, i);
    switch (text[i]) {
      case '&':
        html += "&amp;";
        break;
      case '<':
        html += "&lt;";
        break;
      case '>':
        html += "&gt;";
        break;
      case '"':
        html += "&quot;";
        break;
      case '\'':
        html += "&#39;";
        break;
      default:
        html += length == 0 ? "\xef\xbf\xbd" : text.substr(i, length);
    }
    i += std::max<size_t>(length, 1);
  }
  return html;
}

}  // namespace pangea
