#pragma once

// The steps with AprilTags: the alignment of a candidate that names a tag, and what tags say
// against the alignment of any other candidate.

#include <vector>

#include "core/tags/tag_sizes.h"
#include "loop_verification/steps/verification.h"

namespace pangea {

struct TagOptions {
  std::vector<SizedTags> tags;
  double max_tag_chi2 = 4;     // per degree of freedom; 1 if the covariances hold
  double min_tag_margin = 12;  // chi2; a square has a second pose that nearly fits
  // As max_sigma_m and max_sigma_rad of other candidates. A tag seen from one side says less about
  // its yaw, and cannot be the wrong one.
  double max_tag_sigma_m = 0.1;
  double max_tag_sigma_rad = 0.035;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.AddList("tags", &tags, [](Archive& list, SizedTags& item) { item.Visit(list); });
    archive.Add("max_tag_chi2", &max_tag_chi2, {0.1, 100000}, "",
                "of the corners of tags, per degree of freedom");
    archive.Add("min_tag_margin", &min_tag_margin, {0, 100000}, "",
                "chi2 between the best and any other alignment by tags");
    archive.Add("max_tag_sigma_m", &max_tag_sigma_m, {0.001, 100}, "m",
                "of the worst direction, by tags");
    archive.Add("max_tag_sigma_rad", &max_tag_sigma_rad, {0.0001, 3.15}, "rad",
                "of the worst direction, by tags");
  }
};

// Aligns the windows by the tags that both see (tags/tag_alignment.h).
std::string AlignTags(const TagOptions& options, Verification* verification);

std::string CheckTagCertainty(const TagOptions& options, Verification* verification);

// Refuses an alignment that puts a tag of one window where the other window saw another tag.
std::string CheckOtherTags(const TagOptions& options, Verification* verification);

}  // namespace pangea
