#pragma once

// Draws anchors into the images of the agents that see them.

#include <string>

#include "report/metrics/report_metrics.h"

namespace pangea {

inline constexpr size_t kMaxAnchorPictures = 4;
inline constexpr const char* kAnchorPictureExplained =
    "Left: where the agent placed it. Right: another agent's image. The cube stands where the "
    "agent shows the anchor, the circle is where ground truth has it.";

// One row for each of the first kMaxAnchorPictures anchors in images of two agents: the image in
// which it was placed, and the other agent's image in which it is furthest inside. Returns a JPEG;
// empty if there is no anchor or no recording. Reading errors are added to `notes`.
std::string AnchorsJpeg(const CapturedSession& session, const ReportMetrics& metrics,
                        std::vector<std::string>* notes);

}  // namespace pangea
