#pragma once

// The sizes of a site's tags, as its tags.yaml or the options of a process give them.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/tags/tag.h"

namespace pangea {

// Tags of one size.
struct SizedTags {
  std::string family = "36h11";
  std::string ids;    // "7", "0-99", "0-19, 30"
  double size_m = 0;  // side of the black square

  template <typename Archive>
  void Visit(Archive& archive) {
    constexpr double kMinSize_m = 0.005;
    constexpr double kMaxSize_m = 5;
    archive.AddText("family", 20, &family);
    archive.AddText("ids", 500, &ids);
    archive.AddBetween("size_m", kMinSize_m, kMaxSize_m, &size_m);
    archive.Require("ids");
    archive.Require("size_m");
  }
};

class TagSizes {
 public:
  TagSizes() = default;
  // Throws std::runtime_error, which begins with the field, for example "tags[1].ids: ...".
  explicit TagSizes(const std::vector<SizedTags>& tags);

  // Metres; nothing if the size is not known.
  std::optional<double> Of(const TagId& tag) const;
  const std::map<TagId, double>& all() const { return sizes_; }

 private:
  std::map<TagId, double> sizes_;
};

}  // namespace pangea
