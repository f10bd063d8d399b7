#include "tags/tag_sheet.h"

#include <fmt/format.h>

#include "tags/tag_pattern.h"

namespace pangea {
namespace {

constexpr double kPageWidth_mm = 210, kPageHeight_mm = 297;
constexpr double kTop_mm = 20;

// The black cells; those of a row that touch are one rectangle, so that no gap shows between them.
std::string BlackCells(const TagPattern& pattern, double cell_mm, double left_mm) {
  std::string svg;
  for (int row = 0; row < pattern.cells; ++row) {
    for (int column = 0; column < pattern.cells; ++column) {
      int end = column;
      while (end < pattern.cells && !pattern.IsWhite(row, end)) {
        ++end;
      }
      if (end > column) {
        svg += fmt::format("<rect x='{:.4f}' y='{:.4f}' width='{:.4f}' height='{:.4f}'/>\n",
                           left_mm + column * cell_mm, kTop_mm + row * cell_mm,
                           (end - column) * cell_mm, cell_mm);
        column = end;
      }
    }
  }
  return svg;
}

std::string Text(double y_mm, double height_mm, const std::string& text) {
  return fmt::format(
      "<text x='{:.1f}' y='{:.1f}' font-family='sans-serif' font-size='{}' "
      "text-anchor='middle'>{}</text>\n",
      kPageWidth_mm / 2, y_mm, height_mm, text);
}

}  // namespace

std::string TagSheet(const TagId& tag, double size_mm) {
  const TagPattern pattern = PatternOf(tag);
  const double cell_mm = size_mm / pattern.square_cells;
  const double width_mm = pattern.cells * cell_mm;
  const double below_mm = kTop_mm + width_mm + 12;
  return fmt::format(
             "<svg xmlns='http://www.w3.org/2000/svg' width='{0}mm' height='{1}mm' "
             "viewBox='0 0 {0} {1}' shape-rendering='crispEdges'>\n"
             "<rect width='100%' height='100%' fill='white'/>\n",
             kPageWidth_mm, kPageHeight_mm) +
         BlackCells(pattern, cell_mm, (kPageWidth_mm - width_mm) / 2) +
         Text(below_mm, 9, fmt::format("{}  ·  {:g} mm", ToString(tag), size_mm)) +
         Text(below_mm + 9, 4.5,
              fmt::format("Print at 100 %. The black square's side must measure {:g} mm.",
                          size_mm)) +
         Text(below_mm + 16, 4.5, "Keep the white border. Mount it flat, where it stays.") +
         "</svg>\n";
}

}  // namespace pangea
